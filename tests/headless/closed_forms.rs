//! Strands against Kirchhoff's rod: figures that `headless --scene rods` prints are within their tolerance.

use crate::{check, rods_measured as measured};

#[test]
fn hair_bends_as_a_cantilever() {
    check(measured::cantilevers(2, &[16]));
}

#[test]
fn a_level_curl_twists_as_an_arc() {
    check(measured::arcs(&[16]));
}

#[test]
#[ignore = "takes minutes"]
fn a_heavy_tip_bends_hair() {
    check(measured::tip_loads());
}

#[test]
#[ignore = "takes minutes"]
fn a_helix_is_a_spring() {
    check(measured::helices());
}

#[test]
#[ignore = "takes minutes"]
fn upright_hair_buckles_where_greenhill_says() {
    check(measured::greenhill());
}

#[test]
#[ignore = "takes minutes"]
fn level_hair_stays_in_its_plane() {
    check(measured::no_lateral_buckling());
}

#[test]
#[ignore = "takes minutes"]
fn a_twisted_rod_buckles() {
    check(measured::wrung());
}

#[test]
fn a_tip_on_a_plate_slips() {
    check(measured::slips(&[16]));
}

#[test]
fn a_slope_holds_what_it_should() {
    check(measured::slopes());
}

#[test]
fn a_cylinder_holds_what_it_should() {
    check(measured::capstans());
}

#[test]
#[ignore = "takes minutes"]
fn a_twisted_ring_leaves_its_plane() {
    check(measured::rings());
}
