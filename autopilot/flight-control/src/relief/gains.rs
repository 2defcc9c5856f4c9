//! Gains of the relief.

use serde::{Deserialize, Serialize};

/// Gains of [`super::Relief`]; rows `RLF_*` of the parameter table.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ReliefGains {
    /// Lag on the yaw shortage, s.
    pub shortage_lag_s: f64,
    /// Yaw shortage at which the roll relief is full, rad/s².
    pub shortage_full: f64,
    /// Time constant with which the roll relief comes, s.
    pub rise_s: f64,
    /// Time constant with which it goes, s.
    pub fall_s: f64,
    /// Time by which the relief leads the sideslip, s.
    pub lead_s: f64,
    /// Sideslip from which on it leads, rad.
    pub lead_beta_rad: f64,
    /// Nozzle yaw that the allocation leaves for what is quicker than the lag, rad.
    pub reserve_rad: f64,
    /// Thrust that a growing yaw shortage asks for, as a multiple of what would give its growth at 0.2 rad of nozzle.
    pub boost: f64,
    /// Time over which the growth counts, s.
    pub boost_s: f64,
    /// Airspeed above its reference from which on no more thrust is asked for, fading over the same again, m/s.
    pub boost_over_m_s: f64,
    /// Part of the nozzle's pitch travel that the thrust floor leaves to a steady demand.
    pub floor_use: f64,
    /// Largest thrust floor as a part of the drag: the rest is how the aircraft can still slow down.
    pub floor_drag: f64,
    /// How far the estimate has to swing from one turn to the next, and come back, to count, in units of the activation levels.
    pub oscillation_level: f64,
    /// Half cycles in a row after which the compensator yields.
    pub oscillation_count: f64,
    /// Time constant of the part of the estimate that is still compensated then, s.
    pub yield_lag_s: f64,
    /// Part of the aileron command of the main controller that is held back where the oscillation goes on all the same.
    pub yield_main: f64,
    /// Time after which the compensator tries again; it doubles each time that the oscillation is back, s.
    pub retry_s: f64,
}

impl Default for ReliefGains {
    fn default() -> Self {
        Self::REFERENCE
    }
}

impl ReliefGains {
    /// This project's choice; docs/beyond-the-paper.md says what they were flown with.
    pub const REFERENCE: Self = Self {
        shortage_lag_s: 1.0,
        shortage_full: 0.02,
        rise_s: 0.03,
        fall_s: 1.5,
        lead_s: 0.5,
        lead_beta_rad: 0.14,
        reserve_rad: 0.035,
        boost: 2.0,
        boost_s: 5.0,
        boost_over_m_s: 10.0,
        floor_use: 0.85,
        floor_drag: 0.85,
        oscillation_level: 0.7,
        oscillation_count: 3.0,
        yield_lag_s: 1.5,
        yield_main: 0.5,
        retry_s: 20.0,
    };
}
