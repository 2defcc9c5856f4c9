//! Specifications of studies and campaigns, as texts; docs/campaigns.md says what they may have.
#![no_std]

// A file and its name once.
macro_rules! files {
    ($($name:literal),+ $(,)?) => {
        &[$(($name, include_str!(concat!($name, ".toml")))),+]
    };
}

// A scenario of the suite, with the laws of all of them.
macro_rules! suite {
    ($($number:literal),+) => {
        [$((
            concat!("ftc-", $number),
            concat!(
                include_str!(concat!("suite/ftc-", $number, ".toml")),
                include_str!("suite/laws.toml")
            ),
        )),+]
    };
}

pub const STUDIES: &[(&str, &str)] = files![
    "jams",
    "jams-tuned",
    "combinations",
    "aircraft",
    "robustness",
    "delay",
    "damage",
    "tuning",
    "gust",
    "smoke",
    "engine-fade",
    "jam-table",
    "envelope",
    "sensor-faults",
    "sensor-losses",
    "estimator",
    "false-alarms",
    "detection",
    "detection-jams",
    "isolation",
    "isolation-pairs",
    "landings",
];

/// Campaigns that stay as they are, so that laws can be compared across versions and papers.
pub const SUITE: [(&str, &str); 12] =
    suite!["01", "02", "03", "04", "05", "06", "07", "08", "09", "10", "11", "12"];
