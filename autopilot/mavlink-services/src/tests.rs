//! Conversations in virtual time: a ground station that uses the crate's own encoder, the real
//! control side, and a plant that answers as the test sets it.

mod commands;
mod every_command;
mod fault_list;
mod fault_params;
mod faults;
mod ftp;
mod heartbeat;
mod link_loss;
mod links;
mod logs;
mod loss;
mod manual;
mod mission;
mod mode_switch;
mod modes;
mod offboard;
mod params;
mod places;
mod plan_commands;
mod positions;
mod qgc_files;
mod qgc_modes;
mod qgc_parameters;
mod references;
mod robustness;
mod scripts;
mod shell;
mod signing;
mod state;
mod storage;
mod system_id;
pub(super) mod world;
