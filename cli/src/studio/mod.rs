//! The page of `policyc studio`: its files, and a server of them on this machine.

mod request;
mod server;
mod site;

pub use server::open;
pub use site::Site;
