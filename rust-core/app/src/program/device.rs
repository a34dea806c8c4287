//! The option `--device`: steps on a graphics processor.

use super::Failure;
use concordem_gpu::DeviceSteps;
use concordem_gpu::device::{self, emulated::Emulated};
use concordem_scenario::schema::Scenario;
use concordem_solver::StepDevice;

/// The device that takes the steps.
#[derive(Debug, Clone, Default, clap::Args)]
pub(super) struct DeviceArguments {
    /// Take the steps on a graphics processor, with bitwise equal results: gpu. Needs a build with
    /// `--features gpu`
    #[arg(long, value_name = "NAME", value_enum)]
    device: Option<DeviceName>,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum DeviceName {
    /// The first graphics processor of NVIDIA.
    Gpu,
    /// Its kernels in a loop on the processor, for tests: slow.
    #[value(hide = true)]
    Emulated,
}

impl DeviceArguments {
    /// The device, if one is asked for; fails if it cannot take steps of this scenario.
    pub(super) fn open(&self, scenario: &Scenario) -> Result<Option<Box<dyn StepDevice>>, Failure> {
        let Some(name) = self.device else { return Ok(None) };
        scenario.check_device()?;
        let refused = |error: device::DeviceError| Failure::Usage(format!("--device: {error}"));
        let device = match name {
            DeviceName::Gpu => device::gpu().map_err(refused)?,
            DeviceName::Emulated => Box::new(Emulated::default()),
        };
        Ok(Some(Box::new(DeviceSteps::new(device).map_err(refused)?)))
    }
}
