//! Grooms: files read and written, malformed ones refused, strands reshaped and worn.

mod cache;
#[cfg(feature = "render")]
mod drawn;
mod files;
mod gltf;
mod malformed;
mod odd;
mod reload;
mod reshape;
mod tressfx;
mod worn;
mod yuksel;
