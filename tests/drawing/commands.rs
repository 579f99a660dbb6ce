//! Examples that draw without a window.

use crate::example::{example, hair_file};

pub fn a_tail_in_the_wrong_unit_is_shown_in_the_right_one_and_without_a_head() {
    let (folder, file) = hair_file("tail");
    let arguments = ["--seconds", "1", "--size", "64x64", "--offscreen"];
    let mut viewer = example("groom_viewer");
    let out = viewer.arg(file).args(arguments).arg(&folder).output().unwrap();
    std::fs::remove_dir_all(folder).unwrap();
    let (text, why) = (String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
    assert!(out.status.success(), "{why}");
    assert!(text.contains("with 0.00254 m a unit it is 7.62"), "{text}");
    assert!(text.contains("shown as by --scale 1\n"), "{text}");
    assert!(text.contains("no head:"), "{text}");
    assert!(text.contains("40 strands and 0 followers") && text.contains("0 broken"), "{text}");
}
