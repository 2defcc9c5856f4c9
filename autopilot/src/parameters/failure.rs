//! Parameters of fault injection: what MAV_CMD_INJECT_FAILURE has no room for.
//!
//! They are read when an order is given, so a later change leaves an active fault as it is.

use serde::{Deserialize, Serialize};

/// Sizes and times of faults. Sizes in degrees are for the seven effectors that turn; `engine_pct` is the
/// engine's for all of them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FailureParameters {
    /// Fault injection is allowed.
    pub enabled: bool,
    /// STUCK means stuck at `stuck_deg` instead of where it is.
    pub stuck_at_angle: bool,
    /// Angle of STUCK, deg.
    pub stuck_deg: f64,
    /// A stuck effector travels to its angle at the actuator's rate instead of jumping.
    pub stuck_travels: bool,
    /// What WRONG means.
    pub wrong: WrongMode,
    /// Effect that is left after a loss, percent.
    pub remaining_pct: f64,
    /// Size of a bias, deg.
    pub bias_deg: f64,
    /// Largest deflection of limited travel, deg.
    pub limit_deg: f64,
    /// Largest speed of SLOW, deg/s.
    pub rate_dps: f64,
    /// Delay of DELAYED, ms.
    pub delay_ms: f64,
    /// Part of each period of INTERMITTENT in which commands get through, percent.
    pub present_pct: f64,
    /// Period of INTERMITTENT, s.
    pub period_s: f64,
    /// Amplitude of GARBAGE, deg.
    pub oscillation_deg: f64,
    /// Frequency of GARBAGE, Hz.
    pub oscillation_hz: f64,
    /// Speed and direction of DRIFT, deg/s.
    pub drift_dps: f64,
    /// The engine's bias, limit and amplitude, percent of its largest thrust; its speed and drift, percent/s.
    pub engine_pct: f64,
    /// Time from nothing to the whole fault, s; not used for kinds without a size.
    pub ramp_s: f64,
    /// How long a fault acts, s; 0 for ever.
    pub duration_s: f64,
    /// From one onset to the next, s; 0 once only.
    pub every_s: f64,
    /// How often it acts in all; 0 without end.
    pub times: u32,
}

/// What WRONG means where the order does not say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum WrongMode {
    /// Loss of effectiveness.
    Loss,
    /// Off by a constant.
    Bias,
    /// Runs to the end of positive deflections.
    HardOverPositive,
    /// Runs to the end of negative deflections.
    HardOverNegative,
    /// Moves only so far.
    Limit,
}

impl FailureParameters {
    pub(super) const DEFAULT: Self = Self {
        enabled: true,
        stuck_at_angle: false,
        stuck_deg: 0.0,
        stuck_travels: false,
        wrong: WrongMode::Loss,
        remaining_pct: 50.0,
        bias_deg: 5.0,
        limit_deg: 5.0,
        rate_dps: 10.0,
        delay_ms: 200.0,
        present_pct: 50.0,
        period_s: 1.0,
        oscillation_deg: 5.0,
        oscillation_hz: 2.0,
        drift_dps: 1.0,
        engine_pct: 10.0,
        ramp_s: 0.0,
        duration_s: 0.0,
        every_s: 0.0,
        times: 0,
    };
}
