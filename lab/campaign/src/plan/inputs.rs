//! The texts that decide the results of a campaign, as its fingerprint has them.

use std::path::PathBuf;

use host_io::problem::Problem;
use lab_engine::configuration::Named;
use sha2::{Digest, Sha256};

use super::{Aircraft, Law};
use crate::spec::SpecFile;

/// A text that decides the results. Its name does not: a file may lie elsewhere on another machine.
#[derive(Debug)]
pub(super) struct InputText {
    pub(super) name: String,
    pub(super) sha256: [u8; 32],
}

/// Specification, scenario, files of each aircraft and of each law, as they are now.
pub(super) fn inputs(
    file: &SpecFile,
    scenario: &Named,
    aircraft: &[Aircraft],
    laws: &[Law],
) -> Result<Vec<InputText>, Problem> {
    let input = |name: String, text: &str| InputText { name, sha256: Sha256::digest(text).into() };
    let mut inputs =
        vec![input(file.name.clone(), &file.text), input(scenario.name.clone(), &scenario.text)];
    for Aircraft { name, args, .. } in aircraft {
        let shown = |path: &Option<PathBuf>, what: &str| {
            path.as_ref().map_or_else(|| format!("{what} of {name}"), |p| p.display().to_string())
        };
        // As parsed, so that a comment does not make another campaign.
        let (airframe, model) = (args.airframe_table()?, args.model_table()?);
        inputs.push(input(shown(&args.airframe, "airframe"), &airframe.to_string()));
        inputs.push(input(shown(&args.model, "model"), &model.to_string()));
    }
    for (law, Law { args, .. }) in file.spec.law.iter().zip(laws) {
        // A law without a file differs from one with an empty file.
        let gains = args.gains.as_deref().map(Named::read).transpose()?;
        let text = gains.as_ref().map_or("none", |gains| gains.text.as_ref());
        inputs
            .push(input(gains.as_ref().map_or_else(|| law.name.clone(), |g| g.name.clone()), text));
    }
    Ok(inputs)
}
