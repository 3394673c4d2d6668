//! Series of DICOM: order, places, values, and what is refused.

use crate::read_samples::dicom::{Dicom, frames};
use crate::read_samples::gzip;
use read::{Fault, Loaded, Notes, ReadError, ReadParams, file};
use splat_core::glam::DVec3;
use splat_core::{Grid, UpAxis};
use std::path::{Path, PathBuf};

fn folder(name: &str, slices: &[Dicom]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("dicom-{name}"));
    // It is not there at the first run.
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    for (i, slice) in slices.iter().enumerate() {
        std::fs::write(folder.join(format!("IM{i}")), slice.bytes()).unwrap();
    }
    folder
}

fn read(path: &Path, params: &ReadParams) -> Result<(Grid, Notes), ReadError> {
    file(path, params, None).map(|(loaded, notes)| match loaded {
        Loaded::Grid(grid) => (grid, notes),
        _ => panic!("a volume"),
    })
}

fn volume(path: &Path) -> (Grid, Notes) {
    read(path, &ReadParams::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn refused(name: &str, slices: &[Dicom]) -> String {
    let error = read(&folder(name, slices), &ReadParams::default()).unwrap_err();
    assert_eq!(error.fault, Fault::Input, "{error}");
    error.to_string()
}

#[test]
fn slices_lie_in_the_order_of_their_places_with_hounsfield_units() {
    let expected: Vec<f32> = (-2..22).map(|v| 2.0 * v as f32 - 1000.0).collect();
    for (syntax, bits) in [(".1", [16, 12]), ("", [16, 16]), (".5", [16, 12]), (".5", [8, 8]), (".1", [32, 20])] {
        // The names have another order than the places.
        let slices = [2, 0, 3, 1].map(|rank| Dicom { syntax, bits, ..Dicom::at(rank) });
        let path = folder("order", &slices);
        let (grid, notes) = volume(&path);
        assert_eq!(grid.values, expected, "{syntax} {bits:?}");
        assert_eq!((grid.dims, grid.origin), ([3, 2, 4], DVec3::new(-10.0, -20.0, 30.0)));
        let axes = [grid.axes.x_axis, grid.axes.y_axis, grid.axes.z_axis];
        assert_eq!(axes, [DVec3::new(-0.25, 0.0, 0.0), DVec3::new(0.0, -0.5, 0.0), DVec3::new(0.0, 0.0, 1.5)]);
        assert_eq!((notes.format.as_str(), notes.remarks[0].as_str()), ("Dicom", "series 1.2.3 (head, 4 slices)"));
        assert_eq!(read::stated_up_axis(&path), Some(UpAxis::Z));
        // One file stands for its series.
        assert_eq!(volume(&path.join("IM2")).0, grid);
    }
}

#[test]
fn of_several_series_the_one_of_most_slices_is_read_or_the_one_that_is_named() {
    let other = |rank| Dicom { series: "1.2.4", description: "bone", ..Dicom::at(rank) };
    let path = folder("series", &[Dicom::at(0), other(0), other(1), other(2), Dicom::at(1)]);
    std::fs::write(path.join("notes.txt"), "of the day").unwrap();
    let (grid, notes) = volume(&path);
    assert_eq!((grid.dims[2], notes.unused), (3, vec!["file notes.txt".to_owned()]));
    assert_eq!(
        notes.remarks[0],
        "series 1.2.4 (bone, 3 slices) is drawn; `array` of a scene or --color-by chooses another: 1.2.3 (head, 2 slices)"
    );
    for name in ["1.2.3", "head"] {
        let params = ReadParams { array: Some(name.to_owned()), ..ReadParams::default() };
        assert_eq!(read(&path, &params).unwrap().0.dims[2], 2);
    }
    assert_eq!(volume(&path.join("IM0")).0.dims[2], 2);
    let error = read(&path, &ReadParams { array: Some("lung".to_owned()), ..ReadParams::default() }).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("expected a series among 1.2.4 (bone, 3 slices), 1.2.3 (head, 2 slices), found 'lung'"),
        "{error}"
    );
    let twice: Vec<Dicom> = [0, 1, 0, 1]
        .into_iter()
        .enumerate()
        .map(|(i, rank)| Dicom { number: i as u32, values: vec![i as i32; 6], ..Dicom::at(rank) })
        .collect();
    let path = folder("times", &twice);
    let second = read(&path, &ReadParams { frame: 1, ..ReadParams::default() }).unwrap().0;
    assert_eq!([second.values[0], second.values[6]], [-996.0, -994.0]);
    assert_eq!(volume(&path).0.values[0], -1000.0);
}

#[test]
fn tilted_slices_are_sheared_and_gaps_and_other_slices_are_refused() {
    let tilted: Vec<Dicom> =
        (0..3).map(|i| Dicom { position: [0.0, 0.5 * f64::from(i), f64::from(i)], ..Dicom::at(i) }).collect();
    let (grid, notes) = volume(&folder("tilted", &tilted));
    assert_eq!(grid.axes.z_axis, DVec3::new(0.0, -0.5, 1.0));
    assert!(notes.remarks.iter().any(|r| r.contains("tilted by 26.5651 degrees")), "{:?}", notes.remarks);
    let [a, b, c, d] = [0, 1, 2, 4].map(Dicom::at);
    let said = refused("gap", &[a.clone(), b.clone(), c.clone(), d]);
    assert!(said.contains("expected slices at equal steps of 1.5, found 3 between 'IM2' and 'IM3'"), "{said}");
    assert!(refused("double", &[a.clone(), b.clone(), b.clone()]).contains("'IM1' and 'IM2' at one place"));
    assert!(refused("one", std::slice::from_ref(&a)).contains("expected two slices or more, found one"));
    let turned = Dicom { orientation: "0\\1\\0\\1\\0\\0", ..c.clone() };
    assert!(refused("turned", &[a.clone(), b.clone(), turned]).contains("others in 'IM2'"));
    for (slice, said) in [
        (
            Dicom { syntax: ".4.70", ..a.clone() },
            "packed as JPEG, JPEG 2000 or a movie (1.2.840.10008.1.2.4.70)\nhint: convert the series, such as with `dcm2niix",
        ),
        (Dicom { syntax: ".2", ..a.clone() }, "big endian"),
        (Dicom { frames: "20", ..a.clone() }, "expected the slice 'IM0': 240 bytes of pixels, found 12"),
        (Dicom { frames: "0", ..a.clone() }, "expected the slice 'IM0': 1 to 65536 frames, found '0'"),
        (Dicom { meaning: "RGB", ..a.clone() }, "RGB as PhotometricInterpretation"),
        (Dicom { orientation: "1\\0\\0\\1\\0\\0", ..a.clone() }, "two directions at right angles"),
        (Dicom { orientation: "1\\0\\0", ..a.clone() }, "six numbers of ImageOrientationPatient"),
        (Dicom { values: vec![0; 5], ..a.clone() }, "expected the slice 'IM0': 12 bytes of pixels, found 10"),
    ] {
        let error = refused("other", &[slice, b.clone()]);
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn frames_of_one_file_lie_where_their_groups_say() {
    let path = folder("frames", &[]);
    let file = path.join("all.dcm");
    for ends_by_delimiter in [false, true] {
        // Frames are stored from the last to the first.
        std::fs::write(&file, frames(&[33.0, 31.5, 30.0], ends_by_delimiter)).unwrap();
        for source in [&file, &path] {
            let (grid, notes) = volume(source);
            assert_eq!((grid.dims, grid.origin), ([3, 2, 3], DVec3::new(-10.0, -20.0, 30.0)));
            let axes = [grid.axes.x_axis, grid.axes.y_axis, grid.axes.z_axis];
            assert_eq!(axes, [DVec3::new(-0.25, 0.0, 0.0), DVec3::new(0.0, -0.5, 0.0), DVec3::new(0.0, 0.0, 1.5)]);
            let expected = [10, 4, -2].into_iter().flat_map(|first| first..first + 6);
            assert_eq!(grid.values, expected.map(|v| 2.0 * v as f32 - 1000.0).collect::<Vec<_>>());
            assert_eq!((notes.remarks[0].as_str(), notes.unit.as_deref()), ("series 1.2.5 (, 3 slices)", Some("mm")));
        }
    }
    let error = |places: &[f64]| {
        std::fs::write(&file, frames(places, false)).unwrap();
        read(&file, &ReadParams::default()).unwrap_err().to_string()
    };
    let gap = error(&[30.0, 31.0, 32.0, 34.0]);
    assert!(gap.contains("found 2 between 'all.dcm, frame 3' and 'all.dcm, frame 4'"), "{gap}");
    assert!(error(&[30.0]).contains("two slices or more"));
    // A place of a frame is missing, and each truncation ends in an error.
    let whole = frames(&[30.0, 31.0], true);
    let cut = whole.windows(4).position(|bytes| bytes == [0x20, 0, 0x13, 0x91]).unwrap();
    let mut other = whole.clone();
    other[cut + 2] = 0x14;
    for content in (0..whole.len()).step_by(7).map(|end| &whole[..end]).chain([&other[..]]) {
        std::fs::write(&file, content).unwrap();
        assert!(read(&file, &ReadParams::default()).is_err(), "{}", content.len());
    }
}

#[test]
fn a_file_of_another_series_that_is_no_volume_is_left_out_and_named() {
    let path = folder("beside", &[]);
    std::fs::write(path.join("all.dcm"), frames(&[33.0, 31.5, 30.0], true)).unwrap();
    let screen = Dicom { series: "1.2.9", description: "screen", meaning: "RGB", ..Dicom::at(0) };
    let scout = Dicom { series: "1.2.8", description: "scout", orientation: "1\\0\\0", ..Dicom::at(0) };
    let plain = Dicom { series: "1.2.7", description: "plain", ..Dicom::at(0) };
    let movie = Dicom { series: "1.2.6", description: "movie", syntax: ".4.70", ..Dicom::at(0) };
    for (name, slice) in [("a.dcm", &screen), ("b.dcm", &scout), ("c.dcm", &plain), ("d.dcm", &movie)] {
        std::fs::write(path.join(name), slice.bytes()).unwrap();
    }
    std::fs::write(path.join("z.png"), b"\x89PNG").unwrap();
    let (grid, notes) = volume(&path);
    assert_eq!((grid.dims[2], notes.unused), (3, vec!["file z.png".to_owned()]));
    assert_eq!(
        notes.remarks[..4],
        [
            "another series is left out, as it is no volume: expected the slice 'a.dcm': one number a pixel, found RGB as PhotometricInterpretation",
            "another series is left out, as it is no volume: expected the slice 'b.dcm': six numbers of ImageOrientationPatient, found none, or another one",
            "another series is left out, as it is no volume: expected the slice 'd.dcm': little endian numbers, plain or packed as RLE, found a file that is packed as JPEG, JPEG 2000 or a movie (1.2.840.10008.1.2.4.70)",
            "series 1.2.5 (, 3 slices) is drawn; `array` of a scene or --color-by chooses another: 1.2.7 (plain, 1 slice), 1.2.6 (movie, refused), 1.2.8 (scout, refused), 1.2.9 (screen, refused)",
        ]
    );
    assert_eq!(volume(&path.join("all.dcm")).0, grid);
    // The one that is named is refused for what is wrong with it.
    let named = ReadParams { array: Some("screen".to_owned()), ..ReadParams::default() };
    for (source, params) in [(path.join("a.dcm"), ReadParams::default()), (path, named)] {
        let error = read(&source, &params).unwrap_err().to_string();
        assert!(error.contains("RGB as PhotometricInterpretation"), "{error}");
    }
}

#[cfg(unix)]
#[test]
fn links_out_of_the_folder_are_no_slices() {
    let elsewhere = folder("elsewhere", &[Dicom::at(2)]);
    let path = folder("links", &[Dicom::at(0), Dicom::at(1)]);
    std::os::unix::fs::symlink(elsewhere.join("IM0"), path.join("IM2")).unwrap();
    let (grid, notes) = read(&path, &ReadParams::default()).unwrap();
    assert_eq!(grid.dims[2], 2);
    assert!(notes.unused.iter().any(|what| what.contains("a link out of the folder")), "{:?}", notes.unused);
    // A file that is named is read wherever it lies.
    let (grid, _) = read(&path.join("IM2"), &ReadParams::default()).unwrap();
    assert_eq!(grid.dims[2], 3);
}

#[test]
fn slices_may_be_in_gzip_and_a_segmentation_of_bits_is_called_so() {
    let slices: Vec<Dicom> = (0..3).map(Dicom::at).collect();
    let plain = volume(&folder("plain", &slices)).0;
    let path = folder("gzip", &slices);
    for i in 0..3 {
        let file = path.join(format!("IM{i}"));
        std::fs::write(path.join(format!("IM{i}.dcm.gz")), gzip(&std::fs::read(&file).unwrap())).unwrap();
        std::fs::remove_file(&file).unwrap();
    }
    assert_eq!(volume(&path).0, plain);
    assert_eq!(volume(&path.join("IM1.dcm.gz")).0, plain);
    let bits = refused("bits", &[Dicom { bits: [1, 1], ..Dicom::at(0) }]);
    assert!(bits.contains("found a segmentation of 1 bit a pixel") && !bits.contains("damaged"), "{bits}");
}
