//! The mission protocol: uploads and downloads of plans, item by item.

pub(super) mod client;
mod conversations;
mod fences;
mod files;
mod garbage;
mod guided;
mod home;
mod items;
mod loss;
mod refusals;
mod restored;
mod silence;
mod uploads;
