//! Programs and servers that tests and the `cost` example share.
#![allow(dead_code, reason = "each user of this module needs a part of it")]

pub(crate) mod hall;
pub(crate) mod outputs;
