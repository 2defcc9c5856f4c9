//! What of a plan is accepted and not flown as it is written: reported once, when the plan is in force.

/// One kind of difference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Note {
    /// A waypoint with a hold time.
    HoldTime,
    /// An acceptance radius below the parameter `NAV_ACC_RAD`.
    Acceptance,
    /// A speed over the ground.
    GroundSpeed,
    /// A takeoff.
    Takeoff,
    /// A circle that cannot be flown so small at this airspeed, m/s; it needs this radius, m.
    Widened {
        /// Airspeed reference when the circle begins, m/s.
        airspeed_m_s: f64,
        /// Smallest radius, m.
        radius_m: f64,
    },
}

impl Note {
    fn text(self) -> String {
        match self {
            Self::HoldTime => "hold time is not flown, a wing cannot stand still".into(),
            Self::Acceptance => "acceptance radius is below NAV_ACC_RAD and not used".into(),
            Self::GroundSpeed => "ground speed is flown as airspeed".into(),
            Self::Takeoff => "takeoff is flown as a waypoint".into(),
            Self::Widened { airspeed_m_s, radius_m } => {
                format!("at {airspeed_m_s:.0} m/s the circle needs {radius_m:.0} m and is widened")
            }
        }
    }
}

/// The notes of a plan, one of each kind.
#[derive(Debug, Clone, Default)]
pub struct Notes(Vec<(Note, u16, u16)>);

impl Notes {
    /// One more, about an item.
    pub fn add(&mut self, note: Note, item: u16) {
        let same = |known: &&mut (Note, u16, u16)| {
            core::mem::discriminant(&known.0) == core::mem::discriminant(&note)
        };
        match self.0.iter_mut().find(same) {
            Some((_, _, more)) => *more += 1,
            None => self.0.push((note, item, 0)),
        }
    }

    /// The notes as texts.
    pub fn texts(&self) -> impl Iterator<Item = String> + '_ {
        self.0.iter().map(|(note, item, more)| match more {
            0 => format!("Mission item {item}: {}", note.text()),
            _ => format!("Mission item {item} and {more} more: {}", note.text()),
        })
    }
}
