//! Several vehicles on one computer: the number of each, and the addresses and files that follow from it.

use std::fmt::Display;
use std::net::{Ipv4Addr, SocketAddr};
use std::str::FromStr;

/// Advice where an address is in use.
pub const ADVICE: &str = "a second vehicle on this computer needs --instance 1, a third one 2";
/// Where the autopilot of the first vehicle waits for its plant.
const PLANT_LINK_PORT: u16 = 9_960;

/// Number of a vehicle among several on one computer, as of PX4's `-i`; 0 is the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Instance(u8);

impl Instance {
    /// The highest number: its system id is the highest of a vehicle.
    pub const MAX: u8 = 249;

    pub const fn system_id(self) -> u8 {
        self.0 + 1
    }

    /// An address of this computer whose port is `first` for the first vehicle, and `step` higher for each further one.
    pub fn local(self, first: u16, step: u16) -> SocketAddr {
        SocketAddr::from((Ipv4Addr::LOCALHOST, first + step * u16::from(self.0)))
    }

    /// Where the autopilot waits for the plant.
    pub fn plant_link(self) -> SocketAddr {
        self.local(PLANT_LINK_PORT, 1)
    }

    /// A file or folder inside the user's data folder.
    pub fn file(self, name: &str) -> String {
        match self.0 {
            0 => format!("two-step/{name}"),
            number => format!("two-step/instance-{number}/{name}"),
        }
    }
}

impl FromStr for Instance {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        whole(0, Self::MAX)(text).map(Self)
    }
}

/// A reader of whole numbers in a range, for options.
pub fn whole<T>(min: T, max: T) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync
where
    T: FromStr + Display + PartialOrd + Copy + Send + Sync,
{
    move |text: &str| match text.parse() {
        Ok(value) if (min..=max).contains(&value) => Ok(value),
        _ => Err(format!("{text} is not a whole number from {min} to {max}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vehicles_share_neither_an_address_nor_a_file_nor_a_system_id() {
        let all = || (0..=Instance::MAX).map(Instance);
        let count = usize::from(Instance::MAX) + 1;
        let different =
            |values: std::collections::BTreeSet<String>| assert_eq!(values.len(), count);
        different(all().map(|vehicle| vehicle.plant_link().to_string()).collect());
        different(all().map(|vehicle| vehicle.local(5_760, 10).to_string()).collect());
        different(all().map(|vehicle| vehicle.file("logs")).collect());
        different(all().map(|vehicle| vehicle.system_id().to_string()).collect());
    }

    #[test]
    fn other_numbers_are_refused_with_the_range() {
        for text in ["-1", "250", "1.5", "", "two"] {
            let refusal = text.parse::<Instance>().unwrap_err();
            assert!(refusal.ends_with("is not a whole number from 0 to 249"), "{refusal}");
        }
        assert_eq!("1".parse(), Ok(Instance(1)));
    }
}
