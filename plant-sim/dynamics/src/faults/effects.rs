//! The present effects of all faults as plain numbers: the form in which the derivative reads them.

use icd::{Effector, PerEffector};

/// The effect of a fault on an effector, and that of the faults on all of them: a value, and one for each effector.
macro_rules! effects {
    ($($(#[$doc:meta])* $field:ident: $healthy:expr,)+) => {
        /// The present effect of a fault on one effector.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct FaultEffect {
            $($(#[$doc])* pub $field: f64,)+
        }

        impl FaultEffect {
            /// No fault: the effector stays as it is, to the bit.
            pub const HEALTHY: Self = Self { $($field: $healthy),+ };
        }

        /// The present effects of the faults on all effectors.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Effects {
            $($field: PerEffector<f64>,)+
            /// Code of the active fault of each effector, for the recorder.
            codes: PerEffector<u8>,
            /// Whether an offset or a limit differs from the healthy one; most of the time none does, and the derivative skips them.
            has_offset_or_limit: bool,
        }

        impl Effects {
            pub fn none() -> Self {
                Self {
                    $($field: PerEffector::from_fn(|_| $healthy),)+
                    codes: PerEffector::default(),
                    has_offset_or_limit: false,
                }
            }

            /// Sets the effect on one effector; `code` is that of the fault kind, 0 for none.
            pub(super) fn set(&mut self, effector: Effector, effect: &FaultEffect, code: u8) {
                $(self.$field[effector] = effect.$field;)+
                self.codes[effector] = code;
                self.has_offset_or_limit = Effector::first(Effector::MAX).any(|e| {
                    self.offset[e] != 0.0
                        || self.low[e] > f64::NEG_INFINITY
                        || self.high[e] < f64::INFINITY
                        || self.rate_limit[e] < f64::INFINITY
                });
            }

            /// The present effect on one effector.
            pub fn of(&self, effector: Effector) -> FaultEffect {
                FaultEffect { $($field: self.$field[effector]),+ }
            }
        }
    };
}

effects! {
    /// 1 while the servo follows its command, 0 while it is stuck or the fault moves it.
    following: 1.0,
    /// Rate at which the fault moves the effector, rad/s or N/s.
    runaway: 0.0,
    /// Remaining effectiveness, as a fraction of the position.
    remaining: 1.0,
    /// Deviation of the effector from its servo, rad or N.
    offset: 0.0,
    /// Lower limit of the position, rad or N.
    low: f64::NEG_INFINITY,
    /// Upper limit of the position, rad or N.
    high: f64::INFINITY,
    /// Rate limit of the servo in either direction, rad/s or N/s.
    rate_limit: f64::INFINITY,
}

impl Effects {
    /// [`icd::FaultKind::code`] of the active fault of each effector; 0 for none.
    pub fn codes(&self) -> &PerEffector<u8> {
        &self.codes
    }

    /// Rates of the first `count` effectors whose healthy servos would move at the rates `healthy`.
    #[inline]
    pub fn rates(&self, count: usize, healthy: &PerEffector<f64>) -> PerEffector<f64> {
        if self.has_offset_or_limit {
            return self.rates_with_limits(healthy);
        }
        PerEffector::first_from_fn(count, |e| self.following[e] * healthy[e] + self.runaway[e])
    }

    #[cold]
    fn rates_with_limits(&self, healthy: &PerEffector<f64>) -> PerEffector<f64> {
        PerEffector::from_fn(|e| {
            let limit = self.rate_limit[e];
            self.following[e] * healthy[e].max(-limit).min(limit) + self.runaway[e]
        })
    }

    /// True position of an effector whose servo is at `servo`, rad or N.
    #[inline]
    pub fn position(&self, effector: Effector, servo: f64) -> f64 {
        if self.has_offset_or_limit {
            (servo + self.offset[effector]).max(self.low[effector]).min(self.high[effector])
        } else {
            servo
        }
    }

    /// True positions of all effectors, rad and N.
    #[inline]
    pub fn positions(&self, servos: &PerEffector<f64>) -> PerEffector<f64> {
        if self.has_offset_or_limit {
            PerEffector::from_fn(|e| self.position(e, servos[e]))
        } else {
            *servos
        }
    }

    /// Effective deflection of an effector whose servo is at `servo`, rad or N: the input of air and jet.
    ///
    /// Implements Eq. (12) for the effect of faults, u = u1 + u_f: the effective deflection is the healthy one plus
    /// u_f, for every kind of [`icd::fault::CATALOGUE`].
    #[inline]
    pub fn effective_deflection(&self, effector: Effector, servo: f64) -> f64 {
        self.remaining[effector] * self.position(effector, servo)
    }

    /// Effective deflections of the first `count` effectors, rad and N.
    #[inline]
    pub fn effective(&self, count: usize, servos: &PerEffector<f64>) -> PerEffector<f64> {
        if self.has_offset_or_limit {
            return self.effective_with_limits(servos);
        }
        PerEffector::first_from_fn(count, |e| self.remaining[e] * servos[e])
    }

    #[cold]
    fn effective_with_limits(&self, servos: &PerEffector<f64>) -> PerEffector<f64> {
        PerEffector::from_fn(|e| self.effective_deflection(e, servos[e]))
    }
}
