//! How far a run has come.

use concordem_scenario::schedule::{Simulation, Stop};

/// Where a process found a stage, or a run without stages, for the first time.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Start {
    stage: usize,
    time: f64,
    step: u64,
    strain: f64,
}

/// How far a run has come since a process began to watch it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Progress {
    start: Option<Start>,
}

/// The completed share of what ends next.
#[derive(Debug, Clone, PartialEq)]
pub struct Done {
    /// 0 to 1.
    pub share: f64,
    /// Name, number from 1, and count of the stage that it is of; `None`: of the whole run.
    pub stage: Option<(String, usize, usize)>,
}

impl Done {
    /// What it is of, for people.
    pub fn name(&self) -> String {
        match &self.stage {
            None => "running".to_owned(),
            Some((name, at, count)) => format!("stage \"{name}\", {at} of {count}"),
        }
    }
}

impl Progress {
    /// The share of the present stage, or of the run, by the stop nearest to being met; `strain`: of the last record. `None` if no stop can be
    /// estimated: a stress, its drop, and rest come when they come.
    pub fn done(&mut self, simulation: &Simulation, strain: f64) -> Option<Done> {
        let stages = &simulation.schedule.stages;
        let clock = simulation.state.clock;
        let ended = simulation.ended_stages().last();
        let stage = simulation.ended_stages().count();
        if self.start.is_none_or(|start| start.stage != stage) {
            // A process that resumes a run knows when the stages before have ended, but not what the strain was then.
            let (time, step) = ended.map_or((clock.time(), clock.step), |(_, time, step)| (time, step));
            self.start = Some(Start { stage, time, step, strain });
        }
        let start = self.start?;
        if let Some(now) = stages.get(stage) {
            let of_strain = now.strain.map(|end| part(strain - start.strain, end - start.strain));
            let of_time = now.stop.time.map(|end| part(clock.time() - start.time, end));
            let of_steps = now.stop.steps.map(|end| part((clock.step - start.step) as f64, end as f64));
            if let Some(share) = nearest([of_strain, of_time, of_steps]) {
                return Some(Done { share, stage: Some((now.name.clone(), stage + 1, stages.len())) });
            }
        }
        let Stop { strain, time, steps, .. } = simulation.schedule.stop;
        let known = strain.is_some() || time.is_some() || steps.is_some();
        known.then(|| Done { share: simulation.progress(), stage: None })
    }
}

/// `done` of `all`, 0 to 1; all of it if nothing is left.
fn part(done: f64, all: f64) -> f64 {
    if all == 0.0 { 1.0 } else { (done / all).clamp(0.0, 1.0) }
}

/// The largest share of those that are known.
fn nearest(shares: [Option<f64>; 3]) -> Option<f64> {
    shares.into_iter().flatten().reduce(f64::max)
}
