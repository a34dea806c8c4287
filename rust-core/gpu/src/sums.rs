//! Sums of the rows of arrays by tile, for each step of a stretch.

use crate::arguments::{Launch, Stops, SumArrays, SumTable};
use crate::buffer::Buffer;
use crate::device::{Device, DeviceError, Kernel};

/// Most steps of a stretch: so many have sums on the device before the host reads them.
pub const STRETCH: usize = 64;

/// Threads that run together: the sums of a table begin at a multiple of it.
const WARP: u64 = 32;

/// Sums of rows of `WIDTH` numbers.
#[derive(Debug, Default)]
pub struct TileSums<const WIDTH: usize> {
    start: Buffer<u32>,
    sums: Buffer<f64>,
    tiles: usize,
    /// Steps that have sums of their own.
    steps: usize,
}

impl<const WIDTH: usize> TileSums<WIDTH> {
    /// Prepare sums of `rows`, arrays on the device for even and odd steps. `start`: first row of each tile, then the number of rows.
    /// `steps`: those that have sums of their own; 1 if only steps that sample have any.
    pub fn load(
        &mut self,
        device: &mut dyn Device,
        rows: [*const f64; 2],
        start: &[u32],
        steps: usize,
    ) -> Result<SumTable, DeviceError> {
        self.tiles = start.len() - 1;
        self.steps = steps;
        self.start.put(device, start)?;
        self.sums.resize(device, steps * self.tiles * WIDTH)?;
        Ok(SumTable {
            first: 0,
            sampled: u64::from(steps == 1),
            rows,
            width: WIDTH as u64,
            tiles: self.tiles as u64,
            start: self.start.pointer(),
            sums: self.sums.pointer(),
            stride: if steps == 1 { 0 } else { self.tiles * WIDTH } as u64,
        })
    }

    /// Sums over all tiles, in the order of the solver, of the first `steps` steps.
    pub fn totals(&self, device: &mut dyn Device, steps: usize) -> Result<Vec<[f64; WIDTH]>, DeviceError> {
        let steps = steps.min(self.steps);
        let mut sums = vec![0.0; steps * self.tiles * WIDTH];
        self.sums.get(device, &mut sums)?;
        let of_step = |sums: &[f64]| {
            sums.chunks_exact(WIDTH).fold([0.0; WIDTH], |mut total, of_tile| {
                for (total, sum) in total.iter_mut().zip(of_tile) {
                    *total += sum;
                }
                total
            })
        };
        Ok(sums.chunks_exact((self.tiles * WIDTH).max(1)).map(of_step).collect())
    }

    /// Give the memory back.
    pub fn free(&mut self, device: &mut dyn Device) {
        self.start.free(device);
        self.sums.free(device);
    }
}

/// The kernel of all sums.
#[derive(Debug, Default)]
pub struct Sums {
    tables: Buffer<SumTable>,
    arguments: Buffer<SumArrays>,
    threads: u64,
}

impl Sums {
    /// Prepare the sums of these tables.
    pub fn load(
        &mut self,
        device: &mut dyn Device,
        mut tables: Vec<SumTable>,
        stops: *mut Stops,
    ) -> Result<(), DeviceError> {
        self.threads = 0;
        for table in &mut tables {
            table.first = self.threads;
            self.threads += (table.tiles * table.width).next_multiple_of(WARP);
        }
        self.tables.put_raw(device, &tables)?;
        let arguments = SumArrays { count: tables.len() as u64, tables: self.tables.pointer(), stops };
        self.arguments.put_raw(device, &[arguments])
    }

    /// Launch the sums of a step.
    pub fn launch(&self, device: &mut dyn Device, launch: Launch) -> Result<(), DeviceError> {
        device.launch(Kernel::Sums, self.threads as usize, self.arguments.address(), launch)
    }
}
