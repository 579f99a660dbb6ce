//! Worlds that move: each figure that `headless --scene worlds` prints is within its tolerance.

use crate::{rows::Row, worlds_measured as measured};

fn check(rows: Vec<Row>) {
    assert!(!rows.is_empty());
    rows.iter().for_each(|row| println!("{row:?}"));
    let outside: Vec<_> = rows.iter().filter(|row| !row.within).collect();
    assert!(outside.is_empty(), "{outside:#?}");
}

#[test]
fn uneven_frames_do_not_move_hair() {
    check(measured::frames());
}

#[test]
fn riders_lean_the_same_at_any_rate_of_ticks() {
    check(measured::riders());
}

#[test]
fn hair_that_was_away_comes_back_at_rest() {
    check(measured::returns());
}

#[test]
fn a_runner_is_put_elsewhere_and_its_hair_goes_on() {
    check(measured::portals());
}

#[test]
fn the_air_of_a_vehicle_moves_with_it() {
    check(measured::vehicles());
}

#[test]
fn wind_and_headwind_are_in_the_same_units_at_any_scale() {
    check(measured::scales());
}

#[test]
fn a_squashed_head_is_drawn_as_it_is_simulated() {
    check(measured::squashed());
}

#[test]
fn hair_of_a_hidden_head_waits() {
    check(measured::hidden());
}

#[test]
fn gusts_of_a_long_game_are_those_of_a_young_one() {
    check(measured::gusts());
}
