//! Gains of the relief.

gain_set! {
    /// Gains of [`super::Relief`]; rows `RLF_*` of the parameter table.
    ///
    /// This project's choice; docs/laws.md says what they were flown with.
    ReliefGains at relief {
        /// Lag on the yaw shortage, s.
        shortage_lag_s = 1.0, "RLF_LAG" "s", 0.05 to 20.0, "Lag on the yaw acceleration that is missing";
        /// Yaw shortage at which the roll relief is full, rad/s².
        shortage_full = 0.02, "RLF_FULL" "rad/s^2", 0.001 to 10.0, "Missing yaw acceleration at which the roll relief is full";
        /// Time constant with which the roll relief comes, s.
        rise_s = 0.03, "RLF_T_UP" "s", 0.005 to 10.0, "Time constant with which the roll relief comes";
        /// Time constant with which it goes, s.
        fall_s = 1.5, "RLF_T_DOWN" "s", 0.005 to 60.0, "Time constant with which the roll relief goes";
        /// Time by which the relief leads the sideslip, s.
        lead_s = 0.5, "RLF_LEAD" "s", 0.0 to 5.0, "Time by which the roll relief leads the sideslip";
        /// Sideslip from which on it leads, rad.
        lead_beta_rad = 0.14, "RLF_LEAD_B" "rad", 0.0 to 1.0, "Sideslip from which on the roll relief leads it";
        /// Nozzle yaw that the allocation leaves for what is quicker than the lag, rad.
        reserve_rad = 0.035, "RLF_RESERVE" "rad", 0.0 to 0.1, "Nozzle yaw that is kept for what is quicker than RLF_LAG";
        /// Thrust that a growing yaw shortage asks for, as a multiple of what would give its growth at 0.2 rad of nozzle.
        boost = 2.0, "RLF_BOOST" "-", 0.0 to 20.0, "Thrust for a growing yaw shortage, as a multiple of what gives it at 0.2 rad of nozzle";
        /// Time over which the growth counts, s.
        boost_s = 5.0, "RLF_BOOST_T" "s", 0.05 to 60.0, "Time over which the growth counts";
        /// Airspeed above its reference from which on no more thrust is asked for, fading over the same again, m/s.
        boost_over_m_s = 10.0, "RLF_BOOST_V" "m/s", 0.1 to 200.0, "Airspeed above its reference from which on the boost fades, over the same again";
        /// Part of the nozzle's pitch travel that the thrust floor leaves to a steady demand.
        floor_use = 0.85, "RLF_FLOOR" "-", 0.1 to 1.0, "Part of the nozzle pitch travel that the thrust floor leaves to a steady demand";
        /// Largest thrust floor as a part of the drag: the rest is how the aircraft can still slow down.
        floor_drag = 0.85, "RLF_FLOOR_D" "-", 0.0 to 2.0, "Largest thrust floor as a part of the drag";
        /// How far the estimate has to swing from one turn to the next, and come back, to count, in units of the activation levels.
        oscillation_level = 0.7, "RLF_OSC_LVL" "-", 0.01 to 100.0, "Swing of an oscillating estimate that counts, in activation levels";
        /// Half cycles in a row after which the compensator yields.
        oscillation_count = 3.0, "RLF_OSC_N" "-", 2.0 to 100.0, "Half cycles in a row after which the compensator yields";
        /// Time constant of the part of the estimate that is still compensated then, s.
        yield_lag_s = 1.5, "RLF_OSC_LAG" "s", 0.05 to 60.0, "Lag on the estimate that is still compensated then";
        /// Part of the aileron command of the main controller that is held back where the oscillation goes on all the same.
        yield_main = 0.5, "RLF_OSC_MAIN" "-", 0.0 to 1.0, "Part of the aileron command of the main controller that is held back where it oscillates on";
        /// Time after which the compensator tries again; it doubles each time that the oscillation is back, s.
        retry_s = 20.0, "RLF_OSC_RETRY" "s", 1.0 to 600.0, "Time after which it tries again; doubles each time the oscillation is back";
    }
}
