//! A law that the program provides: it flies where `CTL_LAW` is 9 (`--law own`).

use std::error::Error;
use std::fmt;
use std::sync::Arc;

use flight_control::Law;

/// Why a law has failed.
pub type Failure = Arc<dyn Error + Send + Sync>;

/// A law with the state of one flight. Every [`Law`] that can be cloned is one.
pub trait FlightLaw: Law + Send {
    /// The law with its present state; `None` if it cannot be copied, so that a copy of the flight is refused.
    fn copy(&self) -> Option<Box<dyn FlightLaw>>;

    /// Why the law gives no more commands, if it has failed. A [`Law`] is total; one that wraps something that is not repeats its
    /// last command from then on.
    fn failure(&self) -> Option<Failure> {
        None
    }
}

impl<L: Law + Clone + Send + 'static> FlightLaw for L {
    fn copy(&self) -> Option<Box<dyn FlightLaw>> {
        Some(Box::new(self.clone()))
    }
}

/// What a law of the program is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OwnRole {
    /// Main controller, `CTL_LAW` 9.
    Main,
    /// Compensator beside any main controller, `FTC_ALLOC` 9.
    Compensator,
    Both,
}

impl OwnRole {
    pub const fn is_main(self) -> bool {
        matches!(self, Self::Main | Self::Both)
    }

    pub const fn compensates(self) -> bool {
        matches!(self, Self::Compensator | Self::Both)
    }
}

/// A law that the program brings: its name, and what makes one for each flight.
#[derive(Clone)]
pub struct OwnLaw {
    name: Arc<str>,
    role: OwnRole,
    /// Parameters that it flies with in a campaign.
    settings: Arc<[(String, f64)]>,
    /// What makes one for each flight.
    make: Arc<dyn Fn() -> Box<dyn FlightLaw> + Send + Sync>,
}

impl OwnLaw {
    /// `make` is called at the start of each flight, on any thread.
    pub fn new<L: FlightLaw + 'static>(
        name: &str,
        make: impl Fn() -> L + Send + Sync + 'static,
    ) -> Self {
        Self {
            name: name.into(),
            role: OwnRole::Main,
            settings: Arc::default(),
            make: Arc::new(move || Box::new(make())),
        }
    }

    /// The same for something else than a main controller.
    #[must_use]
    pub fn in_role(self, role: OwnRole) -> Self {
        Self { role, ..self }
    }

    /// The same with parameters that it flies with in a campaign, beside other laws.
    #[must_use]
    pub fn with(self, settings: &[(String, f64)]) -> Self {
        Self { settings: settings.into(), ..self }
    }

    pub fn settings(&self) -> &[(String, f64)] {
        &self.settings
    }

    pub fn role(&self) -> OwnRole {
        self.role
    }

    /// The parameters that select it.
    pub fn selection(&self) -> impl Iterator<Item = (&'static str, f64)> + use<> {
        let main = self.role.is_main().then_some(("CTL_LAW", 9.0));
        main.into_iter().chain(self.role.compensates().then_some(("FTC_ALLOC", 9.0)))
    }

    /// Name in tables and outcomes.
    pub fn name(&self) -> &str {
        &self.name
    }
}

impl fmt::Debug for OwnLaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("OwnLaw").field(&self.name).finish()
    }
}

/// The same law, not only one of the same name.
impl PartialEq for OwnLaw {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.make, &other.make)
    }
}

impl Eq for OwnLaw {}

/// The law of a flight and its constructor.
pub struct Brought {
    pub(crate) own: OwnLaw,
    law: Box<dyn FlightLaw>,
    has_flown: bool,
}

impl Brought {
    /// With a law that has not flown yet.
    pub fn new(own: OwnLaw) -> Self {
        let law = (own.make)();
        Self { own, law, has_flown: false }
    }

    /// A law that has not flown yet.
    pub fn renew(&mut self) {
        if self.has_flown {
            *self = Self::new(self.own.clone());
        }
    }

    /// The law of this flight.
    pub fn law(&self) -> &dyn FlightLaw {
        &*self.law
    }

    /// The same, to be flown.
    pub fn law_mut(&mut self) -> &mut dyn Law {
        self.has_flown = true;
        &mut *self.law
    }
}

/// A law that cannot be copied starts anew in the copy: see [`crate::autopilot::Autopilot::own_law`].
impl Clone for Brought {
    fn clone(&self) -> Self {
        let own = self.own.clone();
        let law = self.law.copy().unwrap_or_else(|| (own.make)());
        Self { own, law, has_flown: self.has_flown }
    }
}

impl fmt::Debug for Brought {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.own.fmt(f)
    }
}
