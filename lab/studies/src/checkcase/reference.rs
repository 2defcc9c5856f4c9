//! Reference trajectories of other simulators, and the difference of a trajectory from them.
//!
//! A folder has `manifest.json`, which names the simulators of each case and those that set its tolerance, and a folder with a
//! trajectory of each simulator for each case. The rule is that of the data's own checker: the error is the largest distance from the
//! mean of the core simulators, and twice their largest distance from each other is allowed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use host_io::file;
use plant_sim::earth::SPHERE_RADIUS_M;
use plant_sim::geodesy::{self, Radii};
use serde::Deserialize;

use super::trajectory::{Trajectory, quaternion_angle};
use host_io::problem::{At as _, Problem, problem};

/// Longest trajectory file, bytes.
const TRAJECTORY_MAX: u64 = 1 << 26;
/// Factor on the spread of the core simulators that a trajectory may have as its error.
pub const SPREADS: f64 = 2.0;
/// The simulator with the finest step, to which the tight tolerances refer.
const FINEST: &str = "05";

#[derive(Debug, Deserialize)]
struct Manifest {
    floors: BTreeMap<String, f64>,
    cases: BTreeMap<String, CaseInfo>,
}

#[derive(Debug, Deserialize)]
struct CaseInfo {
    title: String,
    earth: String,
    sims: Vec<String>,
    core: BTreeMap<String, Vec<String>>,
    #[serde(default)]
    tight_tol: BTreeMap<String, f64>,
}

/// A folder of reference data.
#[derive(Debug)]
pub struct References {
    folder: PathBuf,
    manifest: Manifest,
}

/// The trajectories of one case.
#[derive(Debug)]
pub struct Reference<'a> {
    about: &'a CaseInfo,
    floors: &'a BTreeMap<String, f64>,
    sims: BTreeMap<&'a str, Trajectory>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quantity {
    /// Name as in the manifest.
    pub name: &'static str,
    /// Group of the manifest that names the core simulators.
    pub group: &'static str,
    pub unit: &'static str,
    kind: QuantityKind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum QuantityKind {
    North,
    East,
    Attitude,
    Column(&'static str),
}

const fn column(
    name: &'static str,
    group: &'static str,
    unit: &'static str,
    column: &'static str,
) -> Quantity {
    Quantity { name, group, unit, kind: QuantityKind::Column(column) }
}

pub const QUANTITIES: [Quantity; 13] = [
    Quantity { name: "pos_n", group: "pos", unit: "m", kind: QuantityKind::North },
    Quantity { name: "pos_e", group: "pos", unit: "m", kind: QuantityKind::East },
    column("alt", "pos", "m", "alt_m"),
    column("vn", "vel", "m/s", "vn_mps"),
    column("ve", "vel", "m/s", "ve_mps"),
    column("vd", "vel", "m/s", "vd_mps"),
    Quantity { name: "att", group: "att", unit: "deg", kind: QuantityKind::Attitude },
    column("p", "rate", "rad/s", "p_rps"),
    column("q", "rate", "rad/s", "q_rps"),
    column("r", "rate", "rad/s", "r_rps"),
    column("grav", "env", "m/s2", "grav_mps2"),
    column("sos", "env", "m/s", "sos_mps"),
    column("rho", "env", "kg/m3", "rho_kgm3"),
];

/// Distance of a trajectory from the reference in one quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Deviation {
    pub quantity: Quantity,
    /// Largest distance from the mean of the core simulators.
    pub error: f64,
    /// Largest distance of two core simulators from each other.
    pub spread: f64,
    /// Allowed error: twice the spread, or what the printed digits resolve.
    pub tolerance: f64,
    /// Distance from the simulator with the finest step, and what is allowed.
    pub tight: Option<(f64, f64)>,
    /// Largest distance of each simulator from the mean of the core ones, and whether it is one of them.
    pub simulators: Vec<(String, f64, bool)>,
}

/// A case flown with one step, beside its reference.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Name in the reference data.
    pub case: String,
    /// What the reference data call it.
    pub title: String,
    /// Step of the integration, ms.
    pub step_ms: f64,
    /// Distance in each quantity.
    pub deviations: Vec<Deviation>,
}

impl Deviation {
    /// Whether the error is allowed; one that is no number is not.
    pub fn passes(&self) -> bool {
        self.error <= self.tolerance
    }

    /// Whether the distance from the simulator with the finest step is allowed.
    pub fn passes_tight(&self) -> bool {
        self.tight.is_none_or(|(error, allowed)| error <= allowed)
    }
}

impl References {
    /// Reads the manifest of a folder.
    pub fn open(folder: &Path) -> Result<Self, Problem> {
        let path = folder.join("manifest.json");
        let bytes = file::read(&path, file::TEXT_MAX).at(path.display())?;
        let manifest = serde_json::from_slice(&bytes).at(path.display())?;
        Ok(Self { folder: folder.to_path_buf(), manifest })
    }

    /// Reads the trajectories of a case.
    pub fn case(&self, case: &str) -> Result<Reference<'_>, Problem> {
        let Some(about) = self.manifest.cases.get(case) else {
            let known = self.manifest.cases.keys().cloned().collect::<Vec<_>>().join(", ");
            return Err(problem!("{}: no case {case}, there are {known}", self.folder.display()));
        };
        let mut sims = BTreeMap::new();
        let mut times: Option<Vec<f64>> = None;
        for sim in &about.sims {
            let path = self.folder.join(case).join(format!("sim_{sim}.csv"));
            let text = file::read_text(&path, TRAJECTORY_MAX).at(path.display())?;
            let trajectory = Trajectory::read(&path.display().to_string(), &text)?;
            // All are compared at the times of the first one.
            let at = times.get_or_insert_with(|| trajectory.times().to_vec());
            sims.insert(sim.as_str(), trajectory.at(at)?);
        }
        Ok(Reference { about, floors: &self.manifest.floors, sims })
    }
}

impl Reference<'_> {
    /// What the case is.
    pub fn title(&self) -> &str {
        &self.about.title
    }

    /// The distance of a trajectory in every quantity that it and the core simulators have.
    pub fn deviations(&self, ours: &Trajectory) -> Result<Vec<Deviation>, Problem> {
        let Some(first) = self.sims.values().next() else { return Ok(Vec::new()) };
        let ours = ours.at(first.times())?;
        let one = |quantity| self.deviation(quantity, &ours);
        Ok(QUANTITIES.into_iter().filter_map(one).collect())
    }

    fn deviation(&self, quantity: Quantity, ours: &Trajectory) -> Option<Deviation> {
        let names = self.about.core.get(quantity.group)?;
        let has_it = |sim: &&Trajectory| quantity.is_in(sim);
        let core: Vec<&Trajectory> =
            names.iter().filter_map(|name| self.sims.get(name.as_str())).filter(has_it).collect();
        if core.is_empty() || !quantity.is_in(ours) {
            return None;
        }
        let largest = |a: &Trajectory, b: &Trajectory| self.largest(quantity, a, b);
        let mean = Trajectory::mean(&core);
        let pairs =
            core.iter().enumerate().flat_map(|(i, a)| core[i + 1..].iter().map(|b| (*a, *b)));
        let spread = pairs.map(|(a, b)| largest(a, b)).fold(0.0, f64::max);
        let floor = self.floors.get(quantity.name).copied().unwrap_or(0.0);
        let allowed = self.about.tight_tol.get(quantity.name);
        let tight = allowed.zip(self.sims.get(FINEST).filter(has_it));
        let all = self.sims.iter().filter(|(_, sim)| quantity.is_in(sim));
        Some(Deviation {
            quantity,
            error: largest(ours, &mean),
            spread,
            tolerance: (SPREADS * spread).max(floor),
            tight: tight.map(|(allowed, finest)| (largest(ours, finest), *allowed)),
            simulators: all
                .map(|(name, sim)| {
                    let is_core = names.iter().any(|core| core == name);
                    ((*name).to_owned(), largest(sim, &mean), is_core)
                })
                .collect(),
        })
    }

    /// Largest distance of two trajectories with the same times.
    fn largest(&self, quantity: Quantity, a: &Trajectory, b: &Trajectory) -> f64 {
        let count = a.times().len().min(b.times().len());
        let distance = |i| self.distance(quantity, a, b, i).abs();
        // A NaN is farther than any number.
        (0..count)
            .map(distance)
            .fold(0.0, |most, next| if next > most || next.is_nan() { next } else { most })
    }

    fn distance(&self, quantity: Quantity, a: &Trajectory, b: &Trajectory, i: usize) -> f64 {
        let at = |trajectory: &Trajectory, name: &str| trajectory.columns[name][i];
        match quantity.kind {
            QuantityKind::Column(name) => at(a, name) - at(b, name),
            QuantityKind::Attitude => quaternion_angle(&a.attitude[i], &b.attitude[i]).to_degrees(),
            QuantityKind::North | QuantityKind::East => {
                let latitude = at(b, "lat_deg").to_radians();
                let radii = self.radii(latitude);
                let altitude_m = at(b, "alt_m");
                if quantity.kind == QuantityKind::North {
                    let way = at(a, "lat_deg") - at(b, "lat_deg");
                    return way.to_radians() * (radii.meridian_m + altitude_m);
                }
                // The short way, also over the date line.
                let way = (at(a, "lon_deg") - at(b, "lon_deg") + 180.0).rem_euclid(360.0) - 180.0;
                way.to_radians() * (radii.prime_vertical_m + altitude_m) * latitude.cos()
            }
        }
    }

    fn radii(&self, latitude_rad: f64) -> Radii {
        if self.about.earth == "round" {
            return Radii { meridian_m: SPHERE_RADIUS_M, prime_vertical_m: SPHERE_RADIUS_M };
        }
        geodesy::radii(latitude_rad.sin())
    }
}

impl Quantity {
    fn is_in(&self, trajectory: &Trajectory) -> bool {
        match self.kind {
            QuantityKind::North | QuantityKind::East => trajectory.columns.contains_key("lat_deg"),
            QuantityKind::Attitude => !trajectory.attitude.is_empty(),
            QuantityKind::Column(name) => trajectory.columns.contains_key(name),
        }
    }
}

#[cfg(test)]
mod tests;
