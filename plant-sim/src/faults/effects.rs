//! What the faults do to the effectors just now, as plain numbers: the form that the derivative reads.

use icd::{Effector, PerEffector};

/// What a fault does to one effector just now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Share {
    /// 1 while the servo follows its command, 0 while it stands still or the fault moves it.
    pub following: f64,
    /// Speed that the fault gives the effector, rad/s or N/s.
    pub runaway: f64,
    /// Fraction of the position that has an effect.
    pub remaining: f64,
    /// Deviation of the effector from its servo, rad or N.
    pub offset: f64,
    /// Lower end of what can be reached, rad or N.
    pub low: f64,
    /// Upper end of what can be reached, rad or N.
    pub high: f64,
    /// Largest speed of the servo either way, rad/s or N/s.
    pub rate_limit: f64,
}

impl Share {
    /// None: everything passes to the bit.
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

/// What the faults do to the effectors just now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effects {
    following: PerEffector<f64>,
    runaway: PerEffector<f64>,
    remaining: PerEffector<f64>,
    /// What acts on each effector, for the record.
    codes: PerEffector<u8>,
    /// Whether any of the numbers below matters. Mostly not, and then nobody reads them.
    is_bent: bool,
    offset: PerEffector<f64>,
    low: PerEffector<f64>,
    high: PerEffector<f64>,
    rate_limit: PerEffector<f64>,
}

impl Effects {
    /// None.
    #[must_use]
    pub fn none() -> Self {
        let all = |value| PerEffector::from_fn(|_| value);
        let healthy = Share::HEALTHY;
        Self {
            following: all(healthy.following),
            runaway: all(healthy.runaway),
            remaining: all(healthy.remaining),
            codes: PerEffector::default(),
            is_bent: false,
            offset: all(healthy.offset),
            low: all(healthy.low),
            high: all(healthy.high),
            rate_limit: all(healthy.rate_limit),
        }
    }

    /// Sets what acts on one effector; `code` is that of the kind, 0 for none.
    pub(super) fn set(&mut self, effector: Effector, share: &Share, code: u8) {
        self.following[effector] = share.following;
        self.runaway[effector] = share.runaway;
        self.remaining[effector] = share.remaining;
        self.codes[effector] = code;
        self.offset[effector] = share.offset;
        self.low[effector] = share.low;
        self.high[effector] = share.high;
        self.rate_limit[effector] = share.rate_limit;
        self.is_bent = Effector::first(Effector::MAX).any(|e| {
            self.offset[e] != 0.0
                || self.low[e] > f64::NEG_INFINITY
                || self.high[e] < f64::INFINITY
                || self.rate_limit[e] < f64::INFINITY
        });
    }

    /// [`icd::FaultKind::code`] of what acts on each effector; 0 for none.
    #[must_use]
    pub fn codes(&self) -> &PerEffector<u8> {
        &self.codes
    }

    /// Speeds of the first `count` effectors whose healthy servos would move at `healthy`.
    #[inline]
    #[must_use]
    pub fn rates(&self, count: usize, healthy: &PerEffector<f64>) -> PerEffector<f64> {
        if self.is_bent {
            return self.bent_rates(healthy);
        }
        PerEffector::first_from_fn(count, |e| self.following[e] * healthy[e] + self.runaway[e])
    }

    #[cold]
    fn bent_rates(&self, healthy: &PerEffector<f64>) -> PerEffector<f64> {
        PerEffector::from_fn(|e| {
            let limit = self.rate_limit[e];
            self.following[e] * healthy[e].max(-limit).min(limit) + self.runaway[e]
        })
    }

    /// Where an effector really is when its servo is at `servo`, rad or N.
    #[inline]
    #[must_use]
    pub fn position(&self, effector: Effector, servo: f64) -> f64 {
        if self.is_bent {
            (servo + self.offset[effector]).max(self.low[effector]).min(self.high[effector])
        } else {
            servo
        }
    }

    /// Where all the effectors really are.
    #[inline]
    #[must_use]
    pub fn positions(&self, servos: &PerEffector<f64>) -> PerEffector<f64> {
        if self.is_bent { PerEffector::from_fn(|e| self.position(e, servos[e])) } else { *servos }
    }

    /// What the air and the jet see of an effector whose servo is at `servo`, rad or N.
    ///
    /// Implements Eq. (12) in what faults add to it, u = u1 + u_f: what acts is the healthy deflection plus
    /// u_f, for every kind in the table of [`crate::faults`].
    #[inline]
    #[must_use]
    pub fn effective_deflection(&self, effector: Effector, servo: f64) -> f64 {
        self.remaining[effector] * self.position(effector, servo)
    }

    /// What the air and the jet see of all the effectors.
    #[inline]
    #[must_use]
    pub fn effective(&self, servos: &PerEffector<f64>) -> PerEffector<f64> {
        if self.is_bent {
            return self.bent_effective(servos);
        }
        PerEffector::from_fn(|e| self.remaining[e] * servos[e])
    }

    #[cold]
    fn bent_effective(&self, servos: &PerEffector<f64>) -> PerEffector<f64> {
        PerEffector::from_fn(|e| self.effective_deflection(e, servos[e]))
    }
}
