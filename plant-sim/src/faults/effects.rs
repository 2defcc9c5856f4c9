//! The present effects of all faults as plain numbers: the form in which the derivative reads them.

use icd::{Effector, PerEffector};

/// The present effect of a fault on one effector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FaultEffect {
    /// 1 while the servo follows its command, 0 while it is stuck or the fault moves it.
    pub following: f64,
    /// Rate at which the fault moves the effector, rad/s or N/s.
    pub runaway: f64,
    /// Remaining effectiveness, as a fraction of the position.
    pub remaining: f64,
    /// Deviation of the effector from its servo, rad or N.
    pub offset: f64,
    /// Lower limit of the position, rad or N.
    pub low: f64,
    /// Upper limit of the position, rad or N.
    pub high: f64,
    /// Rate limit of the servo in either direction, rad/s or N/s.
    pub rate_limit: f64,
}

impl FaultEffect {
    /// No fault: the effector stays as it is, to the bit.
    pub const HEALTHY: Self = Self {
        following: 1.0,
        runaway: 0.0,
        remaining: 1.0,
        offset: 0.0,
        low: f64::NEG_INFINITY,
        high: f64::INFINITY,
        rate_limit: f64::INFINITY,
    };
}

/// The present effects of the faults on all effectors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effects {
    following: PerEffector<f64>,
    runaway: PerEffector<f64>,
    remaining: PerEffector<f64>,
    /// Code of the active fault of each effector, for the recorder.
    codes: PerEffector<u8>,
    /// Whether any of the values below differs from the healthy one; most of the time none does, and the derivative
    /// skips them.
    has_offset_or_limit: bool,
    offset: PerEffector<f64>,
    low: PerEffector<f64>,
    high: PerEffector<f64>,
    rate_limit: PerEffector<f64>,
}

impl Effects {
    pub fn none() -> Self {
        let all = |value| PerEffector::from_fn(|_| value);
        let healthy = FaultEffect::HEALTHY;
        Self {
            following: all(healthy.following),
            runaway: all(healthy.runaway),
            remaining: all(healthy.remaining),
            codes: PerEffector::default(),
            has_offset_or_limit: false,
            offset: all(healthy.offset),
            low: all(healthy.low),
            high: all(healthy.high),
            rate_limit: all(healthy.rate_limit),
        }
    }

    /// Sets the effect on one effector; `code` is that of the fault kind, 0 for none.
    pub(super) fn set(&mut self, effector: Effector, effect: &FaultEffect, code: u8) {
        self.following[effector] = effect.following;
        self.runaway[effector] = effect.runaway;
        self.remaining[effector] = effect.remaining;
        self.codes[effector] = code;
        self.offset[effector] = effect.offset;
        self.low[effector] = effect.low;
        self.high[effector] = effect.high;
        self.rate_limit[effector] = effect.rate_limit;
        self.has_offset_or_limit = Effector::first(Effector::MAX).any(|e| {
            self.offset[e] != 0.0
                || self.low[e] > f64::NEG_INFINITY
                || self.high[e] < f64::INFINITY
                || self.rate_limit[e] < f64::INFINITY
        });
    }

    /// [`icd::FaultKind::code`] of the active fault of each effector; 0 for none.
    pub fn codes(&self) -> &PerEffector<u8> {
        &self.codes
    }

    /// The present effect on one effector.
    pub fn of(&self, effector: Effector) -> FaultEffect {
        FaultEffect {
            following: self.following[effector],
            runaway: self.runaway[effector],
            remaining: self.remaining[effector],
            offset: self.offset[effector],
            low: self.low[effector],
            high: self.high[effector],
            rate_limit: self.rate_limit[effector],
        }
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
