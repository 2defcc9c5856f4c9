//! What a flight log becomes: a page of figures ([`plot`]), and the same flight again, compared bit for bit ([`replay`]).

pub mod plot;
pub mod replay;
