//! Options that choose the laws.

use std::path::PathBuf;

use flight_control::{AllocationMode, CompensatorLaw, MainLaw};

use super::RunError;
use crate::config;
use flight_management::parameters::{self, Parameters};

/// Which laws fly, and with which gains.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct LawArgs {
    /// Main controller, parameter CTL_LAW by name: pid, pid-ganged-nozzle, ndi, lqr, own
    #[arg(long, value_name = "LAW", value_parser = parse_law)]
    pub law: Option<MainLaw>,
    /// Estimator of the compensator, parameter FTC_LAW by name: neso, linear-eso, incremental
    #[arg(long, value_name = "LAW", value_parser = parse_compensator)]
    pub compensator: Option<CompensatorLaw>,
    /// Allocation of the compensating demand, parameter FTC_ALLOC by name: paper, wls
    #[arg(long, value_name = "HOW", value_parser = parse_allocation)]
    pub allocation: Option<AllocationMode>,
    /// Parameters from a file, as `sitl design` writes them
    #[arg(long, value_name = "FILE")]
    pub gains: Option<PathBuf>,
}

impl LawArgs {
    /// Sets what the options say; the rest stays.
    ///
    /// # Errors
    /// [`RunError`] names the file of gains, parameter, value and allowed range.
    pub fn apply(&self, parameters: &mut Parameters) -> Result<(), RunError> {
        if let Some(path) = &self.gains {
            let refused = |problem| RunError::Gains { file: path.clone(), problem };
            parameters::set_from_text(parameters, &config::read(path)?).map_err(refused)?;
        }
        let selection = &mut parameters.gains.selection;
        selection.main = self.law.unwrap_or(selection.main);
        selection.compensator_law = self.compensator.unwrap_or(selection.compensator_law);
        selection.allocation = self.allocation.unwrap_or(selection.allocation);
        Ok(())
    }
}

fn parse_law(text: &str) -> Result<MainLaw, String> {
    by_name("law", text, &MainLaw::NAMES)
}

fn parse_compensator(text: &str) -> Result<CompensatorLaw, String> {
    by_name("law", text, &CompensatorLaw::NAMES)
}

fn parse_allocation(text: &str) -> Result<AllocationMode, String> {
    by_name("allocation", text, &AllocationMode::NAMES)
}

fn by_name<T: Copy>(what: &str, text: &str, names: &[(&str, T)]) -> Result<T, String> {
    names.iter().find(|(name, _)| *name == text).map(|(_, law)| *law).ok_or_else(|| {
        let names: Vec<&str> = names.iter().map(|(name, _)| *name).collect();
        format!("there is no {what} {text}; the {what}s are {}", names.join(", "))
    })
}
