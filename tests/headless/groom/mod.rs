//! Grooms: files read and written, malformed ones refused, strands reshaped and worn.

mod files;
mod gltf;
mod malformed;
mod reshape;
mod tressfx;
mod worn;
mod yuksel;
