//! What differs between deployment targets, as data.
