//! Machines on which nothing can be drawn: one sentence on what to do instead of a panic.

use std::panic;

/// What Bevy 0.19 panics with when it finds no graphics adapter or no display, and what to do.
/// It has no way to ask beforehand with the window's own surface.
const KNOWN: [(&str, &str); 4] = [
    ("Unable to find a GPU", NO_ADAPTER),
    ("Failed to create wgpu surface", NO_ADAPTER),
    ("RequestDeviceError", NO_ADAPTER),
    ("Failed to build event loop", NO_DISPLAY),
];

const NO_ADAPTER: &str = if cfg!(target_os = "linux") {
    "no Vulkan adapter was found: install your graphics card's Vulkan driver, or \
     mesa-vulkan-drivers (Debian, Ubuntu; elsewhere vulkan-swrast) to draw in software"
} else {
    "no graphics adapter was found: install or update your graphics card's driver"
};

const NO_DISPLAY: &str = "there is no display to open a window on: run it in a desktop session, \
     set DISPLAY or WAYLAND_DISPLAY, or draw pictures without a window by `--offscreen DIR` where an \
     example has it";

/// From now on the known failures end the process with a sentence and exit code 1; all others panic
/// as before.
pub fn explain_known() {
    let otherwise = panic::take_hook();
    panic::set_hook(Box::new(move |info| {
        let text = info.payload_as_str().unwrap_or_default();
        match KNOWN.iter().find(|(sign, _)| text.contains(sign)) {
            Some((_, sentence)) => {
                eprintln!("error: {sentence}");
                std::process::exit(1);
            }
            None => otherwise(info),
        }
    }));
}
