//! What a flight log becomes: a page of figures ([`plot`]), the same flight again, compared bit for bit ([`replay`]), and a file
//! for viewers in three dimensions ([`mod@mcap`]).

pub mod mcap;
pub mod plot;
pub mod replay;
