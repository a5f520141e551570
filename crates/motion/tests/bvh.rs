//! The BVH reader on the files people have and on files that are none.

use dynaskin_motion::{Bvh, Channel, MAX_BVH_JOINTS, MotionError, SourceMotion};
use glam::{DMat3, DVec3};

const SMALL: &str = "\
HIERARCHY
ROOT Hips
{
  OFFSET 0 90 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
  JOINT Chest
  {
    OFFSET 0 10 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 5 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.0166667
1 2 3 10 20 30 40 50 60
4 5 6 0 0 0 0 0 90
";

fn parse(text: &str) -> Result<Bvh, MotionError> {
    Bvh::parse(text.as_bytes())
}

#[track_caller]
fn check_same_as_small(text: &str) {
    assert_eq!(parse(text), parse(SMALL), "{text:?}");
}

#[test]
fn a_plain_file_is_read() {
    let bvh = parse(SMALL).unwrap();
    assert_eq!(bvh.frame_count(), 2);
    // What the file has is 60 Hz with the digits that its writer had room for.
    assert_eq!(bvh.frame_seconds, 1.0 / 60.0);
    let [hips, chest] = bvh.joints.as_slice() else {
        panic!("{:?}", bvh.joints)
    };
    assert_eq!((hips.name.as_str(), hips.parent), ("Hips", None));
    assert_eq!((chest.name.as_str(), chest.parent), ("Chest", Some(0)));
    assert_eq!(chest.first_channel, 6);
    assert_eq!(chest.channels, [2, 0, 1].map(Channel::Rotation));
    assert_eq!(chest.end_site, Some(DVec3::new(0.0, 5.0, 0.0)));
    // A position channel takes the place of the offset.
    assert_eq!(bvh.joint_in_parent(1, 0), DVec3::new(4.0, 5.0, 6.0));
    assert_eq!(bvh.joint_in_parent(1, 1), DVec3::new(0.0, 10.0, 0.0));
    assert_eq!(bvh.rest_positions()[1], DVec3::new(0.0, 100.0, 0.0));
    // The turn by 90 degrees about y takes z to x.
    let turned = bvh.world_joints(1)[1].0 * DVec3::Z;
    assert!((turned - DVec3::X).length() < 1e-12);
}

#[test]
fn line_ends_blanks_cases_and_marks_do_not_matter() {
    check_same_as_small(&SMALL.replace('\n', "\r\n"));
    check_same_as_small(&SMALL.replace('\n', "\r"));
    check_same_as_small(&SMALL.replace('\n', "\n\n"));
    check_same_as_small(&SMALL.replace(' ', "\t  "));
    check_same_as_small(&SMALL.replace('\n', " \n"));
    check_same_as_small(&format!("\u{feff}{SMALL}"));
    check_same_as_small(SMALL.trim_end());
    check_same_as_small(&SMALL.replace("\n{", " {").replace("{\n", "{"));
    for (word, other) in [
        ("HIERARCHY", "hierarchy"),
        ("ROOT", "Root"),
        ("JOINT", "joint"),
        ("OFFSET", "Offset"),
        ("CHANNELS", "channels"),
        ("Xposition", "XPOSITION"),
        ("Zrotation", "zrotation"),
        ("End Site", "END SITE"),
        ("End Site", "End Site ChestTip"),
        ("End Site", "EndSite"),
        ("MOTION", "Motion"),
        ("Frames:", "FRAMES :"),
        ("Frames: 2", "frames:2"),
        ("Frame Time:", "frame time :"),
    ] {
        check_same_as_small(&SMALL.replace(word, other));
    }
    check_same_as_small(&SMALL.replace("0.0166667", "1.66667e-2"));
    check_same_as_small(&SMALL.replace("OFFSET 0 10 0", "OFFSET -0.0 1.0E+01 0e0"));
    check_same_as_small(&SMALL.replace("1 2 3 10", "1.000000\t+2e0 .3e1 1E1"));
    // A frame over two lines.
    check_same_as_small(&SMALL.replace("3 10", "3\n10"));
}

#[test]
fn names_keep_prefixes_and_blanks() {
    for name in ["mixamorig:Hips", "Bip01 Pelvis", "Hüfte", "a.b|c", "End"] {
        let bvh = parse(&SMALL.replace("Hips", name)).unwrap();
        assert_eq!(bvh.joints[0].name, name);
    }
}

#[test]
fn joints_may_have_any_channels() {
    let bvh = parse(
        "HIERARCHY\nROOT a\n{\nOFFSET 1 2 3\nCHANNELS 1 Yrotation\nJOINT b\n{\nOFFSET 4 5 6\n\
         CHANNELS 4 Xrotation Zposition Yrotation Xposition\nJOINT c\n{\nOFFSET 7 8 9\n}\n}\n}\n\
         MOTION\nFrames: 1\nFrame Time: 0.01\n0 90 10 0 20\n",
    )
    .unwrap();
    assert_eq!(bvh.joint_in_parent(0, 1), DVec3::new(20.0, 5.0, 10.0));
    let world = bvh.world_joints(0);
    assert_eq!(world[1].1, DVec3::new(21.0, 7.0, 13.0));
    // About x by 90 degrees: y becomes z, z becomes -y.
    assert!((world[2].1 - DVec3::new(28.0, -2.0, 21.0)).length() < 1e-12);
}

/// Rotation about an axis, written out.
fn matrix(axis: usize, degrees: f64) -> DMat3 {
    let (s, c) = degrees.to_radians().sin_cos();
    match axis {
        0 => DMat3::from_cols_array(&[1.0, 0.0, 0.0, 0.0, c, s, 0.0, -s, c]),
        1 => DMat3::from_cols_array(&[c, 0.0, -s, 0.0, 1.0, 0.0, s, 0.0, c]),
        _ => DMat3::from_cols_array(&[c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0]),
    }
}

#[test]
fn every_rotation_order_is_the_product_of_its_channels() {
    let letters = ["X", "Y", "Z"];
    let angles = [35.0, -50.0, 110.0];
    for (i, j, k) in [
        (0, 1, 2),
        (0, 2, 1),
        (1, 0, 2),
        (1, 2, 0),
        (2, 0, 1),
        (2, 1, 0),
        (2, 0, 2),
    ] {
        let channels = [i, j, k]
            .map(|axis| format!("{}rotation", letters[axis]))
            .join(" ");
        let bvh = parse(&format!(
            "HIERARCHY\nROOT a\n{{\nOFFSET 0 0 0\nCHANNELS 3 {channels}\n}}\nMOTION\nFrames: 1\n\
             Frame Time: 0.01\n{} {} {}\n",
            angles[0], angles[1], angles[2]
        ))
        .unwrap();
        let expected = matrix(i, angles[0]) * matrix(j, angles[1]) * matrix(k, angles[2]);
        let got = DMat3::from_quat(bvh.parent_from_joint(0, 0));
        assert!(got.abs_diff_eq(expected, 1e-12), "{channels}");
    }
}

/// The error of a file and the line it names.
#[track_caller]
fn check_error(text: &str, line: usize, mentions: &str) {
    let error = parse(text).expect_err("the file is wrong");
    let message = error.to_string();
    assert!(message.contains(&format!("line {line}")), "{message}");
    assert!(message.contains(mentions), "{message}");
}

#[test]
fn errors_name_the_line_and_what_was_expected() {
    check_error("", 1, "HIERARCHY");
    check_error("glTF\u{2}\0\0\0", 1, "HIERARCHY");
    check_error("H\0I\0E\0R\0", 1, "HIERARCHY");
    check_error(&SMALL.replace("ROOT Hips", "ROOT"), 2, "joint name");
    check_error(
        &SMALL.replace("OFFSET 0 90 0", "OFFSET 0 90"),
        5,
        "three numbers",
    );
    check_error(&SMALL.replace("OFFSET 0 90 0", "OFFSET 0 x 0"), 4, "`x`");
    check_error(
        &SMALL.replace("OFFSET 0 90 0", "OFFSET 0 nan 0"),
        4,
        "usable number",
    );
    check_error(
        &SMALL.replace("OFFSET 0 90 0", "OFFSET 0 1e300 0"),
        4,
        "usable number",
    );
    check_error(&SMALL.replace("CHANNELS 6", "CHANNELS 7"), 6, "channel");
    check_error(&SMALL.replace("CHANNELS 6", "CHANNELS 5"), 5, "JOINT");
    check_error(
        &SMALL.replace("CHANNELS 6", "CHANNELS 99999999999"),
        5,
        "at most 12",
    );
    check_error(
        &SMALL.replace("CHANNELS 6", "CHANNELS -6"),
        5,
        "number of channels",
    );
    check_error(&SMALL.replace("Xposition", "Wposition"), 5, "Wposition");
    check_error(&SMALL.replace("  }\n}\n", "  }\n"), 15, "OFFSET, CHANNELS");
    check_error(&SMALL.replace("MOTION", "}\nMOTION"), 16, "MOTION or ROOT");
    check_error(&SMALL.replace("Frames: 2", "Frames: 0"), 17, "at least 1");
    check_error(&SMALL.replace("Frames: 2", "Frames: -2"), 17, "at least 1");
    check_error(&SMALL.replace("Frames: 2", "Frames: 2.5"), 17, "at least 1");
    check_error(
        &SMALL.replace("Frames: 2", "Frames: 4000000000"),
        17,
        "number of frames",
    );
    check_error(
        &SMALL.replace("Frames: 2", "Frames: 1"),
        20,
        "after the 1 announced",
    );
    for time in ["0", "-0.01", "1e-9", "3600"] {
        check_error(
            &SMALL.replace("0.0166667", time),
            18,
            "between 0.0001 and 10",
        );
    }
    check_error(&SMALL.replace("1 2 3", "1 2"), 20, "frame 1");
    check_error(&SMALL.replace("1 2 3", "1 2 3 4"), 19, "frame 1");
    check_error(&SMALL.replace("1 2 3", "1 2 NaN"), 19, "usable number");
    check_error(&SMALL.replace("1 2 3", "1 2 3,5"), 19, "`3,5`");
    // Not one frame is whole.
    check_error(&SMALL[..SMALL.len() - 25], 19, "truncated");
    check_error(&SMALL[..SMALL.len() / 2], 9, "truncated");
}

#[test]
fn a_file_that_breaks_off_keeps_its_whole_frames_and_says_so() {
    let whole = parse(SMALL).unwrap();
    assert_eq!(whole.break_off(), None);
    // Between frames, within a frame, within a number, and with a last number that may have lost digits.
    let second = SMALL.rfind("4 5 6").unwrap();
    for end in [second, second + 3, second + 4, SMALL.len() - 8] {
        let bvh = parse(&SMALL[..end]).unwrap();
        assert_eq!(bvh.frame_count(), 1, "{end}");
        assert_eq!(bvh.frame_values(0), whole.frame_values(0), "{end}");
        let said = bvh.break_off().unwrap().to_string();
        assert!(said.contains("1 of 2 frames"), "{said}");
    }
    for cut in ["4 5 -", "4 5 6e", "4 5 ."] {
        let bvh = parse(&format!("{}{cut}", &SMALL[..second])).unwrap();
        assert_eq!(bvh.frame_count(), 1, "{cut}");
    }
    for announced in [3, 150_000] {
        let more = parse(&SMALL.replace("Frames: 2", &format!("Frames: {announced}"))).unwrap();
        assert_eq!(more.frame_count(), 2);
        assert_eq!(more.break_off().unwrap().announced_frames, announced);
    }
}

#[test]
fn the_frame_time_is_the_usual_rate_that_is_meant() {
    for (written, rate_hz) in [
        ("0.0333", 30.0),
        ("0.03333", 30.0),
        ("0.033333", 30.0),
        ("0.0333333", 30.0),
        ("0.033", 30.0),
        ("0.03", 1.0 / 0.03),
        ("0.008333", 120.0),
        ("0.00833", 120.0),
        ("0.0083", 120.0),
        ("0.008", 125.0),
        ("0.0166667", 60.0),
        ("0.016667", 60.0),
        ("0.0166", 60.0),
        ("1.66667e-2", 60.0),
        ("0.041667", 24.0),
        ("0.0416666", 24.0),
        ("0.04", 25.0),
        ("0.02", 50.0),
        ("0.01", 100.0),
        // 59.94 and 29.97 Hz are rates of their own.
        ("0.016683", 1.0 / 0.016683),
        ("0.0333667", 1.0 / 0.0333667),
        ("0.0137", 1.0 / 0.0137),
    ] {
        let bvh = parse(&SMALL.replace("0.0166667", written)).unwrap();
        assert!(
            (bvh.frame_seconds * rate_hz - 1.0).abs() < 1e-12,
            "{written}: {}",
            bvh.frame_seconds
        );
    }
}

#[test]
fn utf_16_and_leading_comments_are_read() {
    let units: Vec<u16> = SMALL.encode_utf16().collect();
    for (mark, bytes) in [
        ([0xff, 0xfe], u16::to_le_bytes as fn(u16) -> [u8; 2]),
        ([0xfe, 0xff], u16::to_be_bytes),
    ] {
        let mut file = mark.to_vec();
        file.extend(units.iter().flat_map(|unit| bytes(*unit)));
        assert_eq!(Bvh::parse(&file), parse(SMALL));
        // A byte that is left over is half of a unit that was cut.
        file.pop();
        assert!(Bvh::parse(&file).is_ok());
    }
    check_same_as_small(&format!("# made by hand\n// twice\n; so\n\n{SMALL}"));
    check_error("# only a comment", 1, "HIERARCHY");
}

#[test]
fn depth_and_number_of_joints_are_bounded() {
    let nested = |depth: usize| {
        let open = "JOINT a\n{\nOFFSET 0 1 0\nCHANNELS 1 Xrotation\n".repeat(depth - 1);
        format!(
            "HIERARCHY\nROOT a\n{{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n{open}{}MOTION\nFrames: 1\n\
             Frame Time: 1\n{}\n",
            "}\n".repeat(depth),
            "90 ".repeat(depth)
        )
    };
    let deep = parse(&nested(MAX_BVH_JOINTS)).unwrap();
    assert!(
        deep.world_joints(0)
            .iter()
            .all(|(_, position)| position.is_finite())
    );
    assert!(matches!(
        parse(&nested(MAX_BVH_JOINTS + 1)),
        Err(MotionError::Limit { .. })
    ));
    assert!(matches!(
        parse(&nested(200_000)),
        Err(MotionError::Limit { .. })
    ));
}
