//! Errors of a list of effectors.

use core::fmt;

use super::{EffectorKind, Name};
use crate::effector::Effector;

/// What is wrong with a list of effectors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectorListError {
    /// Name of the effector; empty for the list as a whole.
    pub effector: Name,
    /// What is wrong with it.
    pub problem: ListProblem,
}

/// The kinds of [`EffectorListError`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ListProblem {
    /// The list is empty.
    Empty,
    /// The list has more than [`Effector::MAX`] effectors.
    TooMany,
    /// The name has characters other than lower-case letters, digits and single spaces between them.
    BadName,
    /// Two effectors have the same name.
    DuplicateName,
    /// Two servos or two motors have the same MAVLink number.
    DuplicateInstance {
        /// The number.
        instance: u8,
    },
    /// The MAVLink number is outside its range.
    BadInstance {
        /// The number.
        instance: u8,
    },
    /// There is no effector with the partner's name.
    UnknownPartner {
        /// The name.
        partner: Name,
    },
    /// The partner does not name this effector as its own partner.
    NotMutual {
        /// The partner's name.
        partner: Name,
    },
    /// The two partners are not left and right of the same kind.
    NotMirrored {
        /// The partner's name.
        partner: Name,
    },
    /// A second engine, or a second nozzle for the same axis: an aircraft has at most one of each.
    OnlyOne {
        /// The kind.
        kind: EffectorKind,
    },
}

impl fmt::Display for EffectorListError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.effector.is_empty() {
            write!(f, "effector `{}`: ", self.effector)?;
        }
        match self.problem {
            ListProblem::Empty => f.write_str("there is no [[effector]], expected 1 to 16"),
            ListProblem::TooMany => f.write_str("there are more than 16 effectors, expected 1 to 16"),
            ListProblem::BadName => f.write_str(
                "name is not made of small letters and digits, words apart by single spaces, as in `left aileron`",
            ),
            ListProblem::DuplicateName => f.write_str("name stands there twice, expected each once"),
            ListProblem::DuplicateInstance { instance } => {
                write!(f, "instance = {instance} stands there twice, expected each once")
            }
            ListProblem::BadInstance { instance } => {
                write!(f, "instance = {instance} is outside 1 to {}", Effector::MAX)
            }
            ListProblem::UnknownPartner { partner } => {
                write!(f, "partner = `{partner}` is no effector of this file")
            }
            ListProblem::NotMutual { partner } => {
                write!(f, "partner = `{partner}` does not name this one as its partner")
            }
            ListProblem::NotMirrored { partner } => write!(
                f,
                "partner = `{partner}` is not of the same kind on the other side, expected one left and one right"
            ),
            ListProblem::OnlyOne { kind } => {
                write!(f, "kind = {} stands there twice, expected at most one", kind.key())
            }
        }
    }
}

impl core::error::Error for EffectorListError {}
