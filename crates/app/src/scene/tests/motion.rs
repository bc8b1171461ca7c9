//! `[drive]`, `[hand]`, `[holds]` and `[limits]`: the way, who goes it and what it has to keep.

use super::*;

/// `[drive]` and `[hand]` lend each other the way.
#[test]
fn drive_and_hand_lend_each_other_direction_and_travel() {
    let hand = CLIP.find("[hand]").unwrap();
    let alone = |section: &str| read(format!("{}{section}", &CLIP[..hand])).unwrap();
    let lent = read(CLIP).unwrap();
    let of_hand = lent.hand.as_ref().unwrap();
    assert_eq!(lent.drive.travel, of_hand.travel);
    assert_eq!(lent.drive.direction, of_hand.direction);
    assert_eq!(lent.drive.step, of_hand.travel / 300.0);
    assert!(lent.drive.retract && lent.drive.guide == Guide::Axis);
    let drive = "[drive]\ndirection = [0, 0, 3]\ntravel = 0.002\nstep = 1e-5\nguide = \"free\"\nretract = false\n";
    let scene = alone(drive);
    assert!(scene.hand.is_none());
    assert_eq!(
        (scene.drive.direction, scene.drive.travel),
        (DVec3::Z, 2e-3)
    );
    assert_eq!((scene.drive.step, scene.drive.guide), (1e-5, Guide::Free));
    assert!(!scene.drive.retract);
    let both = alone(&format!("{drive}[hand]\nspeed = 0.01\nstiffness = 500\n"));
    let of_drive = both.hand.unwrap();
    assert_eq!((of_drive.direction, of_drive.travel), (DVec3::Z, 2e-3));
    // 2 sqrt(0.5 kg 500 N/m), to two digits.
    assert_eq!(of_drive.damping, 32.0);
}

#[test]
fn limits_and_the_grip_are_in_the_scenes_units() {
    let text = format!("units = \"mm-N-MPa\"\n{CLIP}");
    let more = "[limits]\ninsertion_below = 9\nstrain_below = 0.02\nstrain_use = \"repeatedly\"\n\
                [holds]\ngrip = [1, 2, 3]\n";
    let scene = read(format!("{text}{more}")).unwrap();
    assert_eq!(scene.limits.insertion_below, Some(9.0));
    assert_eq!(
        (scene.limits.removal_above, scene.limits.strain_below),
        (None, Some(0.02))
    );
    assert_eq!(scene.limits.strain_use, StrainUse::Repeatedly);
    assert!((scene.grip.unwrap() - DVec3::new(1e-3, 2e-3, 3e-3)).length() < 1e-18);
}

#[test]
fn refusals_name_line_key_and_mend() {
    refuses([
        (
            with("0.02", "\"fast\""),
            "clip.toml:19: speed: invalid type: string \"fast\", expected a number",
        ),
        (
            with("[0.0, -2.0, 0.0]", "[0, 0, 0]"),
            "clip.toml:18: direction [0.0, 0.0, 0.0] has no direction; write where it points, such as [0.0, -1.0, 0.0]",
        ),
        (
            with("[0.0, -2.0, 0.0]", "[0, inf, 0]"),
            "clip.toml:18: direction y is inf; write a number",
        ),
        (
            with("[0.0, -2.0, 0.0]", "[0, 1]"),
            "clip.toml:18: direction: invalid length 2, expected 3 numbers",
        ),
        (
            with("[0.0, -2.0, 0.0]", "[0, 1, 0, 0]"),
            "clip.toml:18: direction: invalid length 4, expected 3 numbers",
        ),
        (
            with("speed = 0.02", "speed = 1e-9"),
            "clip.toml:19: travel, speed and hold make 1.4e10 steps of 0.001 s, more than 1e7; move faster or hold for less",
        ),
        (
            adding("mass = -0.1\n"),
            "clip.toml:21: mass -0.1 must be above 0; write a positive number",
        ),
        (
            adding("hold = -1\n"),
            "clip.toml:21: hold -1 must not be negative; write 0 or more",
        ),
    ]);
}
