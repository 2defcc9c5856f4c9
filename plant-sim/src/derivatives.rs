//! The aerodynamic derivatives by name: paper letters, configuration key, allowed range, field.
//!
//! One table serves the reader of the airframe file, its range check, and the campaigns that disperse them.

use crate::aerodynamics::Aero;
use crate::config::{RangeError, check_range};

/// One derivative.
pub struct Derivative {
    /// The letters of the parameter set, as in `Cma`.
    pub name: &'static str,
    /// Key in the `[aerodynamics]` table of the airframe file.
    pub key: &'static str,
    /// Smallest allowed value.
    pub min: f64,
    /// Largest allowed value.
    pub max: f64,
    /// The field.
    pub field: fn(&mut Aero) -> &mut f64,
}

/// Derivatives are refused beyond this size: ten times the largest that any aircraft has.
const LARGEST: f64 = 1_000.0;

macro_rules! derivative {
    ($name:literal, $field:ident, $min:expr) => {
        Derivative {
            name: $name,
            key: stringify!($field),
            min: $min,
            max: LARGEST,
            field: |aero| &mut aero.$field,
        }
    };
}

/// All of them. Drag terms must not be negative: they would feed energy to the aircraft.
pub const DERIVATIVES: [Derivative; 32] = [
    derivative!("CL0", c_lift_zero, -LARGEST),
    derivative!("CLa", c_lift_alpha, -LARGEST),
    derivative!("CLq", c_lift_q, -LARGEST),
    derivative!("CLde", c_lift_elevator, -LARGEST),
    derivative!("CD0", c_drag_zero, 0.0),
    derivative!("kCD", c_drag_induced, 0.0),
    derivative!("CDb", c_drag_beta, 0.0),
    derivative!("CDst", c_drag_stall, 0.0),
    derivative!("CDde", c_drag_elevator, 0.0),
    derivative!("CDda", c_drag_aileron, 0.0),
    derivative!("CDdr", c_drag_rudder, 0.0),
    derivative!("CYb", c_side_beta, -LARGEST),
    derivative!("CYp", c_side_p, -LARGEST),
    derivative!("CYr", c_side_r, -LARGEST),
    derivative!("CYda", c_side_aileron, -LARGEST),
    derivative!("CYdr", c_side_rudder, -LARGEST),
    derivative!("Clb", c_roll_beta, -LARGEST),
    derivative!("Clp", c_roll_p, -LARGEST),
    derivative!("Clr", c_roll_r, -LARGEST),
    derivative!("Clde", c_roll_elevator, -LARGEST),
    derivative!("Clda", c_roll_aileron, -LARGEST),
    derivative!("Cldr", c_roll_rudder, -LARGEST),
    derivative!("Cm0", c_pitch_zero, -LARGEST),
    derivative!("Cma", c_pitch_alpha, -LARGEST),
    derivative!("Cmq", c_pitch_q, -LARGEST),
    derivative!("Cmde", c_pitch_elevator, -LARGEST),
    derivative!("Cnb", c_yaw_beta, -LARGEST),
    derivative!("Cnp", c_yaw_p, -LARGEST),
    derivative!("Cnr", c_yaw_r, -LARGEST),
    derivative!("rCnde", yaw_per_roll_elevator, -LARGEST),
    derivative!("rCnda", yaw_per_roll_aileron, -LARGEST),
    derivative!("Cndr", c_yaw_rudder, -LARGEST),
];

/// The derivative with these letters, as in `Cma`; `None` for any other name.
pub fn by_name<'a>(aero: &'a mut Aero, name: &str) -> Option<&'a mut f64> {
    let derivative = DERIVATIVES.iter().find(|d| d.name == name)?;
    Some((derivative.field)(aero))
}

/// Checks all of them.
///
/// # Errors
/// [`RangeError`] for the first one outside its range.
pub fn check(aero: &Aero) -> Result<(), RangeError> {
    let mut aero = aero.clone();
    for d in &DERIVATIVES {
        check_range("aerodynamics", d.key, *(d.field)(&mut aero), d.min, d.max)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Airframe;

    /// The 28 that the robustness claim disperses.
    const DISPERSED: &str = "CLa CLq CLde CD0 kCD CDb CDde CDda CDdr CYb CYr CYdr Clb Clp Clr Clde Clda \
        Cldr Cm0 Cma Cmq Cmde Cnb Cnp Cnr rCnde rCnda Cndr";

    #[test]
    fn every_dispersed_derivative_has_its_own_field() {
        let nominal = Airframe::paper().aero;
        let names: Vec<_> = DISPERSED.split_whitespace().collect();
        assert_eq!(names.len(), 28);
        let mut seen = Vec::new();
        for name in names {
            let mut changed = nominal.clone();
            *by_name(&mut changed, name).unwrap() += 1.0;
            assert!(changed != nominal && !seen.contains(&changed), "{name} shares a field");
            seen.push(changed);
        }
    }

    #[test]
    fn an_unknown_name_finds_nothing() {
        assert!(by_name(&mut Airframe::paper().aero, "Cmx").is_none());
    }
}
