//! Types of the library as types of this crate: no others cross the bridge.

use std::ops::{Deref, DerefMut};

macro_rules! own {
    ($($name:ident: $of:ty),*) => { $(
        pub(crate) struct $name($of);

        impl From<$of> for Box<$name> {
            fn from(of: $of) -> Self {
                Box::new($name(of))
            }
        }

        impl Deref for $name {
            type Target = $of;

            fn deref(&self) -> &$of {
                &self.0
            }
        }

        impl DerefMut for $name {
            fn deref_mut(&mut self) -> &mut $of {
                &mut self.0
            }
        }
    )* };
}

own!(Log: halite::host::Log, Grid: halite::Grid, Mesh: halite::Mesh, Session: halite::host::Session);
