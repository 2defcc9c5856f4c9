//! Rows of the switch that selects flight modes, with PX4's names and numbers.

use super::{Choice, Get, Kind, Parameter, Set};
use crate::parameters::{SwitchChannel, SwitchMode};

/// In the order of their index on the wire.
pub(super) const ROWS: [&[Parameter]; 2] = [CHANNEL, SLOTS];

const CHANNEL: &[Parameter] = choices! { "Mode switch";
    "RC_MAP_FLTMODE", mode_switch.channel, "Channel of RC_CHANNELS_OVERRIDE that selects a mode when it changes its slot":
        0 SwitchChannel::None "Unassigned",
        5 SwitchChannel::Five "Channel 5",
        6 SwitchChannel::Six "Channel 6",
        7 SwitchChannel::Seven "Channel 7",
        8 SwitchChannel::Eight "Channel 8";
};

/// Name, place and range of each slot; the modes are the same for all.
macro_rules! slots {
    ($($name:literal $place:literal $meaning:literal,)*) => {
        choices! { "Mode switch"; $(
            $name, mode_switch.slots[$place], $meaning:
                -1 SwitchMode::Unassigned "Unassigned",
                0 SwitchMode::Manual "Manual",
                1 SwitchMode::Altitude "Altitude",
                2 SwitchMode::Position "Position",
                3 SwitchMode::Mission "Mission",
                4 SwitchMode::Hold "Hold",
                5 SwitchMode::Return "Return",
                6 SwitchMode::Acro "Acro",
                7 SwitchMode::Offboard "Offboard",
                8 SwitchMode::Stabilized "Stabilized";
        )* }
    };
}

const SLOTS: &[Parameter] = slots! {
    "COM_FLTMODE1" 0 "Mode of the lowest sixth of the switch's channel, from 1000 us",
    "COM_FLTMODE2" 1 "Mode of the second sixth, from 1167 us",
    "COM_FLTMODE3" 2 "Mode of the third sixth, from 1333 us",
    "COM_FLTMODE4" 3 "Mode of the fourth sixth, from 1500 us",
    "COM_FLTMODE5" 4 "Mode of the fifth sixth, from 1667 us",
    "COM_FLTMODE6" 5 "Mode of the highest sixth, from 1833 us to 2000 us",
};
