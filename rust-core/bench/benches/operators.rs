//! Speed of operators, compared with one pass over the same data, and speed of strain from tessellations.
//!
//! The two stress operators are limited by memory and should cost at most twice a pass; compare times of the same run. There
//! are three passes. The first reads pairs, branches, points, and forces (80 bytes per contact); it omits the results of the
//! stress per particle and the positions that both operators read, and includes points that a region does not need. The
//! second reads exactly what a region stress reads; the third reads and writes what the stress per particle does. Times are
//! processor times summed over threads, which other work on the machine hardly disturbs; run with `RAYON_NUM_THREADS=1`.

mod measurement;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rayon::prelude::*;
use std::hint::black_box;

use concordem::math::{Mat3, Vec3};
use concordem::operator::strain::{Dimension, cell_strain};
use concordem::operator::stress::{Partition, particle_moments, region_stress};
use concordem::operator::tessellation::{Domain, delaunay, power_diagram};
use concordem::operator::{ContactSet, LoadSet, Region, Truncation};
use measurement::ProcessorTime;

/// A jittered cubic block of `n³` particles, numbered along x; spacing 1.
fn block(n: usize) -> Vec<Vec3> {
    (0..n * n * n)
        .map(|k| {
            let jitter = |s: usize| ((k * 7919 + s * 104_729) % 1009) as f64 / 1009.0 - 0.5;
            Vec3::new((k % n) as f64, (k / n % n) as f64, (k / (n * n)) as f64)
                + Vec3::new(jitter(1), jitter(2), jitter(3)) * 0.4
        })
        .collect()
}

/// Contacts of the block with nearest neighbors along the axes and the diagonals: about ten per particle.
struct Data {
    position: Vec<Vec3>,
    pair: Vec<[u32; 2]>,
    branch: Vec<Vec3>,
    point: Vec<Vec3>,
    force: Vec<Vec3>,
}

fn contacts(n: usize, most: usize) -> Data {
    let position = block(n);
    let (mut pair, mut branch, mut point, mut force) = (vec![], vec![], vec![], vec![]);
    for a in 0..position.len() {
        let (x, y, z) = (a % n, a / n % n, a / (n * n));
        for (dx, dy, dz) in [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1)] {
            if x + dx < n && y + dy < n && z + dz < n && pair.len() < most {
                let b = a + dx + n * (dy + n * dz);
                let l = position[b] - position[a];
                pair.push([a as u32, b as u32]);
                branch.push(l);
                point.push(position[a] + l * 0.5);
                force.push(l * 1e3);
            }
        }
    }
    Data { position, pair, branch, point, force }
}

/// Sums all numbers, so that the compiler keeps all reads. With eight partial sums, memory limits the speed, not addition.
fn pass(list: &[Vec3]) -> f64 {
    let reals: &[f64] = bytemuck::cast_slice(list);
    reals
        .par_chunks(1 << 15)
        .map(|chunk| {
            let mut sums = [0.0; 8];
            for row in chunk.chunks_exact(8) {
                for (sum, x) in sums.iter_mut().zip(row) {
                    *sum += x;
                }
            }
            sums.iter().sum::<f64>()
        })
        .sum()
}

fn pass_pairs(list: &[[u32; 2]]) -> u64 {
    list.par_chunks(1 << 14).map(|c| c.iter().map(|p| u64::from(p[0] ^ p[1])).sum::<u64>()).sum()
}

fn stress(c: &mut Criterion<ProcessorTime>) {
    let data = contacts(62, 1_000_000);
    let set = ContactSet::new(&data.position, &data.pair, &data.branch, &data.point, &data.force, None).expect("fits");
    assert_eq!(set.len(), 1_000_000);
    let mut group = c.benchmark_group("1e6 contacts");
    group.sample_size(20);
    group.throughput(Throughput::Elements(set.len() as u64));
    group.bench_function("one pass over the data", |bench| {
        bench.iter(|| black_box((pass(&data.branch), pass(&data.point), pass(&data.force), pass_pairs(&data.pair))));
    });
    group.bench_function("one pass, what a region stress reads", |bench| {
        bench.iter(|| black_box((pass(&data.branch), pass(&data.force), pass(&data.position), pass_pairs(&data.pair))));
    });
    group.bench_function("one pass, what stress per particle reads and writes", |bench| {
        bench.iter(|| {
            let written = vec![Mat3::identity(); data.position.len()];
            let vectors = [&data.branch, &data.point, &data.force, &data.position].map(|list| pass(list));
            black_box((vectors, pass_pairs(&data.pair), written))
        });
    });
    let all = Region::All { volume: 1.0 };
    group.bench_function("region stress, all", |bench| {
        bench.iter(|| region_stress(black_box(&set), &all, Truncation::BranchClipped, None));
    });
    let sphere = Region::Sphere { center: Vec3::repeat(31.0), radius: 20.0 };
    for (name, truncation) in [("clipped", Truncation::BranchClipped), ("internal only", Truncation::InternalOnly)] {
        group.bench_function(format!("region stress, sphere, {name}"), |bench| {
            bench.iter(|| region_stress(black_box(&set), &sphere, truncation, None));
        });
    }
    group.bench_function("stress per particle", |bench| {
        bench.iter(|| particle_moments(black_box(&set), &LoadSet::none(), Partition::ContactPoint));
    });
    group.finish();
}

fn tessellation(c: &mut Criterion<ProcessorTime>) {
    let position = block(46);
    let radius = vec![0.4; position.len()];
    let displacement: Vec<Vec3> = position.iter().map(|x| x * 0.01).collect();
    let mut group = c.benchmark_group(format!("{} particles", position.len()));
    group.sample_size(10);
    group.throughput(Throughput::Elements(position.len() as u64));
    group.bench_function("Delaunay triangulation", |bench| {
        bench.iter(|| delaunay(black_box(&position), Dimension::Three, None));
    });
    let mesh = delaunay(&position, Dimension::Three, None).expect("points in space");
    let peak = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = peak.lines().find(|line| line.starts_with("VmHWM")).unwrap_or("").to_owned();
    println!("{} cells, {:.1} MB; peak of the process so far, {peak}", mesh.len(), mesh.bytes() as f64 * 1e-6);
    group.bench_function("strain of its cells", |bench| {
        bench.iter(|| cell_strain(black_box(&mesh), &position, &displacement, None));
    });
    let domain = Domain::Box { low: Vec3::repeat(-1.0), high: Vec3::repeat(46.0) };
    group.bench_function("power diagram", |bench| {
        bench.iter(|| power_diagram(black_box(&position), &radius, &domain, Dimension::Three));
    });
    group.finish();
}

criterion_group! {
    name = operators;
    config = Criterion::default().with_measurement(ProcessorTime);
    targets = stress, tessellation
}
criterion_main!(operators);
