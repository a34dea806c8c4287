//! `concordem watch`: shows a run of another process, from the files that it writes.
//!
//! The particles before the first step are made again from the scenario, as `resume` does, since displacements and the slice refer to
//! them; the state comes from the newest checkpoint, the curve from the segments. The run is not disturbed.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant, SystemTime};

use super::Live;
use crate::output::run_files::Follower;
use crate::program::drive::{Interruption, build_with};
use crate::program::info::share_of;
use crate::program::meter::{Display, Meter};
use crate::program::readable::count;
use crate::program::recording::{SCENARIO_FILE, bond_damage, result_path};
use crate::program::restart::apply_changes;
use crate::program::{Console, Failure, shell};
use concordem_scenario::assembly::{Assembly, Sharpness};
use concordem_scenario::schema::Scenario;

/// Time between two looks at the folder of the run.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// Number of failed looks in a row after which the error is no coincidence: the run removes older files while they are read.
const MOST_FAILURES: u32 = 5;

/// Arguments of `concordem watch`.
#[derive(Debug, clap::Args)]
pub(in crate::program) struct WatchArguments {
    /// Result file of the run, its scenario, or its folder FILE.parts
    run: PathBuf,
    /// Port of the page; 0 takes any free port
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    port: u16,
}

pub(in crate::program) fn watch(arguments: &WatchArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    let path = match arguments.run.extension().and_then(|extension| extension.to_str()) {
        Some("toml") => result_path(&Scenario::read(&arguments.run)?),
        _ => arguments.run.clone(),
    };
    let follower = Follower::of(&path)?.filter(Follower::is_running);
    let Some(follower) = follower else {
        let (file, argument) = (path.display(), shell::argument(&path));
        return Err(Failure::Usage(if path.is_file() {
            format!("{file} is finished; show it with: concordem report {argument}")
        } else {
            format!(
                "no process runs {file}; `concordem watch` shows a run while it goes on. `concordem info {argument}` tells what there is; \
                 `concordem resume --watch` continues an interrupted run"
            )
        }));
    };
    // One thread: the run needs the others.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let pool = pool.map_err(|error| Failure::Usage(format!("cannot start a thread: {error}")))?;
    pool.install(|| show(follower, arguments.port, console))
}

fn show(mut follower: Follower, port: u16, console: &mut Console<'_>) -> Result<(), Failure> {
    let header = &follower.header;
    let file = header.provenance.iter().find(|(name, _)| name == SCENARIO_FILE).map(|(_, file)| file.clone());
    let scenario = Scenario::parse(&file.unwrap_or_default(), &header.scenario)?;
    let at = |name: &str| header.series.iter().position(|series| series.name == name);
    let (width, strain, stress) = (header.series.len().max(1), at("strain"), at("stress"));
    let (cache, meter) = (console.cache(), Meter::new(Display::Nothing));
    let mut assembly = build_with(&scenario, cache.as_ref(), Sharpness::Sufficient, &meter)?;
    let initial = assembly.state.particles.position.clone();
    let Some(mut live) = Live::begin(Some(port), &scenario.title, &initial, &assembly.state, console)? else {
        return Ok(());
    };
    let interruption = Interruption::listen(console.host.as_ref());
    let (mut last, mut failures) = (Vec::new(), 0);
    while !interruption.requested.load(Ordering::Relaxed) {
        // Ask first: what the run wrote before its end is then shown.
        let goes_on = follower.is_running();
        match follower.news() {
            Ok(None) => failures = 0,
            Ok(Some(mut news)) => {
                failures = 0;
                for row in news.samples.chunks_exact(width) {
                    if let (Some(strain), Some(stress)) = (strain, stress) {
                        live.record(row[strain], row[stress]);
                    }
                    last = row.to_vec();
                }
                apply_changes(&mut news.checkpoint, &mut assembly, &scenario, &[], &follower.result(), false)?;
                publish(&mut live, &assembly, &initial, &follower, &last);
            }
            Err(_) if !goes_on => {}
            Err(error) => {
                failures += 1;
                if failures == MOST_FAILURES {
                    return Err(error.into());
                }
            }
        }
        if !goes_on {
            let result = follower.result();
            console.tell(&if result.is_file() {
                format!("the run has ended; its result is {}", result.display())
            } else {
                format!("the run was interrupted; continue with: concordem resume --watch {}", shell::argument(&result))
            });
            break;
        }
        std::thread::sleep(LOOK_EVERY);
    }
    Ok(())
}

/// Shows the state of `assembly`; `last`: the values of the series at the last sample.
fn publish(
    live: &mut Live,
    assembly: &Assembly,
    initial: &[concordem_contact::math::Vec3],
    follower: &Follower,
    last: &[f64],
) {
    let begun = Instant::now();
    let state = &assembly.state;
    let header = &follower.header;
    let value = |name: &str| last.get(header.series.iter().position(|series| series.name == name)?).copied();
    let share = share_of(&header.scenario, value);
    let mut status = format!("step {}, {:.4e} s", count(state.clock.step as usize), state.clock.time());
    if let (Some(strain), Some(stress)) = (value("strain"), value("stress")) {
        let _ = write!(status, ", strain {strain:.3e}, stress {stress:.3e} Pa");
    }
    let _ = write!(status, ", written at {} UTC; a run writes every few seconds at first, later every minute", clock());
    let moved: Vec<_> = state.unwrapped_positions().iter().zip(initial).map(|(now, then)| now - then).collect();
    live.publish(state, share, &moved, &bond_damage(state), &status, begun);
}

/// The time of day, UTC.
fn clock() -> String {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_secs() % 86_400;
    format!("{:02}:{:02}:{:02}", now / 3600, now / 60 % 60, now % 60)
}
