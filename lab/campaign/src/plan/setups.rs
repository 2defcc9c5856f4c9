//! What flies in a campaign: its specification, and a whole flight of each aircraft with each law.

use autopilot::own_law::OwnLaw;
use host_io::problem::Problem;
use lab_judges::outcome::WholeSetup;
use serde_json::json;

use super::Plan;

impl Plan {
    /// The specification and the first flight of each aircraft with each law, as JSON: with the row of a run enough to fly it again,
    /// but for the code of a law of the program.
    pub fn setup_json(&self) -> Result<String, Problem> {
        let laws = self.laws.len() as u64;
        let mut flights = Vec::new();
        for aircraft in &self.aircraft {
            for law in 0..laws {
                let run = self.run(aircraft.first * laws + law)?;
                let setup = self.setup(&run)?;
                let settings = self.settings(&run)?;
                flights.push(json!({
                    "run": run.number,
                    "aircraft": aircraft.name,
                    "law": self.file.spec.law[run.law].name,
                    "seed": run.seed,
                    "settings": settings.iter().map(ToString::to_string).collect::<Vec<_>>(),
                    "fault_known": setup.knows_fault,
                    "own_law": setup.own_law.as_ref().map(OwnLaw::name),
                    "setup": serde_json::to_value(WholeSetup::of(&setup))?,
                }));
            }
        }
        let all = json!({
            "program": "Two-Step sitl campaign",
            "version": env!("CARGO_PKG_VERSION"),
            "fingerprint": self.fingerprint,
            "specification": self.file.text,
            "flights": flights,
        });
        Ok(format!("{all:#}\n"))
    }
}
