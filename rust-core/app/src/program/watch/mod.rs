//! A page on this computer that shows a running specimen.
//!
//! With `run --watch` and `resume --watch`, the run publishes its state about once a second, and less often if that would take more than
//! two percent of the time. `concordem watch` shows a run that was started without it, from the files that the run writes. A thread
//! answers requests from this computer only; it never touches the simulation.

mod follow;
mod server;

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use super::{Console, Failure};
use crate::report::base64;
use concordem_contact::math::Vec3;
use concordem_solver::state::State;
pub(super) use follow::{WatchArguments, watch};
use server::Server;

/// Shortest time between two publications.
const SHORTEST: Duration = Duration::from_secs(1);
/// The time between two publications is at least this many times that of a publication: two percent of the run.
const RARELY: u32 = 50;
/// Largest number of points of the curve; every second one is dropped when there are more.
const MOST_POINTS: usize = 1000;
/// Largest number of particles of the slice.
const MOST_PARTICLES: usize = 4000;
/// Damage from which bonds are drawn.
const SHOWN_DAMAGE: f64 = 0.5;

/// What a page shows of a run.
pub(super) struct Live {
    server: Server,
    title: String,
    slice: Slice,
    curve: Vec<[f64; 2]>,
    /// Records between two points of the curve, and records since the last one.
    every: usize,
    since: usize,
    last: Instant,
    pause: Duration,
}

/// The particles of a slice through the middle, by their place in the state.
struct Slice {
    axes: [usize; 2],
    chosen: Vec<usize>,
    /// Place in `chosen` of each particle; `u32::MAX` outside of the slice.
    place: Vec<u32>,
    /// Longest edge of the specimen, m.
    longest: f64,
    /// Particles as base 64, and sizes.
    head: String,
}

impl Live {
    /// Begins to serve. `initial`: positions that displacements refer to, m.
    ///
    /// # Errors
    /// No port can be opened.
    fn start(port: u16, title: &str, initial: &[Vec3], state: &State) -> Result<Self, Failure> {
        let server = Server::start(port).map_err(|error| {
            Failure::Usage(format!(
                "port {port} of this computer cannot be opened for the page: {error}; 0 takes any free port"
            ))
        })?;
        let slice = Slice::of(initial, state);
        let (every, since, pause) = (1, 0, Duration::ZERO);
        Ok(Self {
            server,
            title: title.to_owned(),
            slice,
            curve: Vec::new(),
            every,
            since,
            last: Instant::now(),
            pause,
        })
    }

    /// Begins to serve if a port was asked for, and prints the address.
    ///
    /// # Errors
    /// The port cannot be opened.
    pub(super) fn begin(
        port: Option<u16>,
        title: &str,
        initial: &[Vec3],
        state: &State,
        console: &mut Console<'_>,
    ) -> Result<Option<Self>, Failure> {
        let live = port.map(|port| Self::start(port, title, initial, state)).transpose()?;
        if let Some(live) = &live {
            console.tell(&format!("watch the run at {}", live.address()));
        }
        Ok(live)
    }

    /// Address of the page.
    fn address(&self) -> String {
        self.server.address()
    }

    /// Adds a record to the curve.
    pub(super) fn record(&mut self, strain: f64, stress: f64) {
        self.since += 1;
        if self.since < self.every {
            return;
        }
        self.since = 0;
        self.curve.push([strain, stress]);
        if self.curve.len() > MOST_POINTS {
            self.every *= 2;
            let mut keep = false;
            self.curve.retain(|_| {
                keep = !keep;
                keep
            });
        }
    }

    /// Whether the page should get a new state.
    pub(super) fn is_due(&self) -> bool {
        self.last.elapsed() >= self.pause
    }

    /// Publishes a state; `share`: done of the run or the present stage, if it is known; `displacement`: of all particles, m; `begun`: when the work for it began.
    pub(super) fn publish(
        &mut self,
        state: &State,
        share: Option<f64>,
        displacement: &[Vec3],
        damage: &[f64],
        status: &str,
        begun: Instant,
    ) {
        let text = self.text(state, share, displacement, damage, status);
        self.server.publish(text);
        self.last = Instant::now();
        self.pause = SHORTEST.max(begun.elapsed() * RARELY);
    }

    fn text(&self, state: &State, share: Option<f64>, displacement: &[Vec3], damage: &[f64], status: &str) -> String {
        let mut curve = String::new();
        for [strain, stress] in self.curve.iter().filter(|point| point.iter().all(|x| x.is_finite())) {
            let comma = if curve.is_empty() { "" } else { "," };
            let _ = write!(curve, "{comma}[{:.5e},{:.5e}]", strain * 1e3, stress * 1e-6);
        }
        let slice = &self.slice;
        let of = |p: usize| slice.axes.map(|axis| displacement[p][axis]);
        let largest = slice.chosen.iter().flat_map(|&p| of(p)).fold(0.0_f64, |most, d| most.max(d.abs()));
        let largest = if largest.is_finite() && largest > 0.0 { largest } else { 1.0 };
        let mut moved = Vec::with_capacity(5 * slice.chosen.len());
        for &p in &slice.chosen {
            for d in of(p) {
                moved.extend(((d / largest * 32_767.0) as i16).to_le_bytes());
            }
            moved.push((255.0 * damage.get(p).copied().unwrap_or(0.0)) as u8);
        }
        let mut bonds: Vec<u8> = Vec::new();
        for block in &state.bonds {
            for k in 0..block.len() {
                let pair = block.view(k).pair;
                let [a, b] = [pair.a, pair.b].map(|p| slice.place[p as usize]);
                if a != u32::MAX && b != u32::MAX && block.damage(k) >= SHOWN_DAMAGE {
                    for place in [a, b] {
                        bonds.extend((place as u16).to_le_bytes());
                    }
                }
            }
        }
        let share = share.map_or_else(|| "null".to_owned(), |share| format!("{share:.4}"));
        format!(
            "{{\"title\": {}, \"status\": {}, \"share\": {share}, \"broken\": {}, \"curve\": [{curve}], \"unit\": {:e}, {}, \
             \"moved\": \"{}\", \"bonds\": \"{}\"}}",
            serde_json::Value::from(self.title.as_str()),
            serde_json::Value::from(status),
            state.broken_bonds().count(),
            largest / slice.longest * 10_000.0,
            slice.head,
            base64(&moved),
            base64(&bonds)
        )
    }
}

impl Slice {
    fn of(initial: &[Vec3], state: &State) -> Self {
        let radius = &state.particles.radius;
        let start = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        let (low, high) = initial
            .iter()
            .zip(radius)
            .fold(start, |(low, high), (x, r)| (low.inf(&x.add_scalar(-r)), high.sup(&x.add_scalar(*r))));
        let size = high - low;
        let flat = size.z <= 2.01 * radius.iter().copied().fold(0.0, f64::max);
        let normal = if flat { 2 } else { usize::from(size.x >= size.y) };
        let axes = [[1, 2], [0, 2], [0, 1]][normal];
        let middle = 0.5 * (low[normal] + high[normal]);
        let distance = |p: &usize| (initial[*p][normal] - middle).abs();
        let mut chosen: Vec<usize> = (0..initial.len()).filter(|p| distance(p) <= radius[*p]).collect();
        chosen.sort_by(|p, q| distance(p).total_cmp(&distance(q)));
        chosen.truncate(MOST_PARTICLES);
        chosen.sort_unstable();
        let mut place = vec![u32::MAX; initial.len()];
        chosen.iter().enumerate().for_each(|(k, &p)| place[p] = k as u32);
        let longest = axes.iter().map(|&axis| size[axis]).fold(f64::MIN_POSITIVE, f64::max);
        let low = axes.map(|axis| low[axis]);
        let number = |x: f64| (x / longest * 10_000.0).clamp(0.0, 65_535.0) as u16;
        let mut bytes = Vec::with_capacity(6 * chosen.len());
        for &p in &chosen {
            let [u, v] = [0, 1].map(|k| initial[p][axes[k]] - low[k]);
            for x in [u, v, radius[p]] {
                bytes.extend(number(x).to_le_bytes());
            }
        }
        let [width, height] = axes.map(|axis| number(size[axis]));
        let head = format!("\"size\": [{width}, {height}], \"particles\": \"{}\"", base64(&bytes));
        Self { axes, chosen, place, longest, head }
    }
}
