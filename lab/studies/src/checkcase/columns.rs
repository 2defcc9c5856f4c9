//! The trajectory of a check case as a table: the columns that comparisons of simulators use, and after them the controls.

use icd::Ned;
use plant_sim::{EarthModel, Plant};

/// Columns after the position: velocity over the ground in local NED, attitude (yaw, pitch, roll, and the quaternion that turns
/// body axes into NED), body rates relative to inertial space, magnitude of the gravitation without the centrifugal part, speed of
/// sound, density, and the motion in the air.
const MOTION: &str = "vn_mps,ve_mps,vd_mps,yaw_deg,pitch_deg,roll_deg,qw,qx,qy,qz,p_rps,q_rps,r_rps,grav_mps2,sos_mps,rho_kgm3,\
                      airspeed_mps,alpha_deg,beta_deg";

/// Header and rows of one flight.
#[derive(Debug)]
pub struct CheckcaseColumns {
    header: String,
    is_flat: bool,
    /// Position at the start, m.
    start: Ned,
}

impl CheckcaseColumns {
    /// For a flight at its start.
    pub fn new(plant: &Plant) -> Self {
        let is_flat = plant.dynamics().earth().model() == EarthModel::Flat;
        let position = if is_flat { "n_m,e_m,d_m" } else { "lat_deg,lon_deg,alt_m" };
        let mut header = format!("time_s,{position},{MOTION}");
        let list = &plant.dynamics().airframe().effectors;
        for effector in list.all() {
            let unit = if list.is_angle(effector) { "deg" } else { "n" };
            header += &format!(",{}_{unit}", list.key(effector));
        }
        Self { header, is_flat, start: plant.truth().position }
    }

    /// Names of the columns.
    pub fn header(&self) -> &str {
        &self.header
    }

    /// The values of this instant, each with all its digits.
    pub fn row(&self, plant: &Plant) -> String {
        let truth = plant.truth();
        let earth = plant.dynamics().earth();
        let position = &plant.state().rigid.position;
        let altitude_m = earth.place(position).geopotential_altitude_m;
        let euler = truth.euler();
        let q = truth.attitude.q_ned_from_body;
        let place = if self.is_flat {
            let way = truth.position.0 - self.start.0;
            [way.x, way.y, way.z]
        } else {
            [truth.latitude_rad.to_degrees(), truth.longitude_rad.to_degrees(), truth.altitude_m]
        };
        let vector = |v: &nalgebra::Vector3<f64>| [v.x, v.y, v.z];
        let angles = [euler.psi, euler.theta, euler.phi].map(f64::to_degrees);
        let environment = [
            earth.gravitation_m_s2(position),
            plant.dynamics().atmosphere().speed_of_sound(altitude_m),
            truth.density_kg_m3,
        ];
        let in_air =
            [truth.airspeed_m_s, truth.alpha_rad.to_degrees(), truth.beta_rad.to_degrees()];
        let list = &plant.dynamics().airframe().effectors;
        let effector = |effector| {
            let at = truth.deflections[effector];
            if list.is_angle(effector) { at.to_degrees() } else { at }
        };
        let values = [truth.time.as_seconds()]
            .into_iter()
            .chain(place)
            .chain(vector(&truth.velocity.0))
            .chain(angles)
            .chain([q.w, q.i, q.j, q.k])
            .chain(vector(&truth.body_rates.0))
            .chain(environment)
            .chain(in_air)
            .chain(list.all().map(effector));
        // The shortest decimals that are this number.
        values.map(|value| format!("{value:?}")).collect::<Vec<_>>().join(",")
    }
}
