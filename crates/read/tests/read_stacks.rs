//! TIFF stacks and folders of slices.

use crate::read_samples::stacks::{SIZE, Stack};
use image::{DynamicImage, GrayImage, ImageFormat, RgbImage};
use read::{Fault, Loaded, Notes, ReadError, ReadParams, bytes, file};
use splat_core::Grid;
use splat_core::glam::DVec3;
use std::path::{Path, PathBuf};

fn read(content: &[u8], params: &ReadParams) -> Result<(Grid, Notes), ReadError> {
    bytes("a.tif", content, params, None).map(|(loaded, notes)| match loaded {
        Loaded::Grid(grid) => (grid, notes),
        _ => panic!("a volume"),
    })
}

fn volume(stack: &Stack) -> (Grid, Notes) {
    read(&stack.bytes(), &ReadParams::default()).unwrap_or_else(|e| panic!("{stack:?}: {e}"))
}

fn refused(stack: &Stack) -> String {
    let error = read(&stack.bytes(), &ReadParams::default()).unwrap_err();
    assert_eq!(error.fault, Fault::Input, "{error}");
    error.to_string()
}

fn steps(grid: &Grid) -> DVec3 {
    DVec3::new(grid.axes.x_axis.x, -grid.axes.y_axis.y, -grid.axes.z_axis.z)
}

#[test]
fn a_stack_of_each_packing_type_and_order_has_its_values() {
    let expected: Vec<f32> = (0..24).map(|v| v as f32).collect();
    let plain = Stack::default();
    let mut stacks = vec![plain.clone(), Stack { tile: 16, ..plain.clone() }, Stack { is_wide: true, ..plain.clone() }];
    for packing in [1, 5, 8, 32773] {
        for (has_differences, big_endian) in [(false, false), (true, false), (true, true)] {
            stacks.push(Stack { packing, has_differences, big_endian, ..plain.clone() });
        }
    }
    for (bits, format) in [(8, 1), (8, 2), (16, 2), (32, 1), (32, 2), (32, 3), (64, 3)] {
        let big_endian = bits > 16;
        stacks.push(Stack {
            bits,
            format,
            big_endian,
            is_wide: bits == 64,
            tile: if bits == 32 { 16 } else { 0 },
            ..plain.clone()
        });
    }
    for meaning in [0, 2, 3] {
        stacks.push(Stack { meaning, ..plain.clone() });
        stacks.push(Stack { meaning, big_endian: true, is_wide: true, ..plain.clone() });
    }
    for stack in stacks {
        let (grid, notes) = volume(&stack);
        assert_eq!(grid.values, expected, "{stack:?}");
        assert_eq!(grid.dims, SIZE.map(|n| n as usize));
        assert_eq!((notes.format.as_str(), steps(&grid)), ("Tiff", DVec3::ONE));
        // The first row is the highest and the first page the nearest; nothing is mirrored.
        assert_eq!(grid.origin, DVec3::new(0.0, 1.0, 3.0));
        assert!(grid.axes.determinant() > 0.0);
        let said = notes.remarks.iter().any(|remark| remark.contains("as they are stored"));
        assert_eq!(said, stack.meaning != 1, "{:?}", notes.remarks);
    }
    // Tiles that reach beyond the page, of numbers that LZW hardly packs: each has a code of its own.
    let noise = |i: u32| f64::from(i.wrapping_mul(2_654_435_761) >> 16);
    let pages: Vec<Vec<f64>> = (0..2).map(|z| (0..37 * 41).map(|i| noise(z * 37 * 41 + i)).collect()).collect();
    let noisy = Stack { packing: 5, tile: 16, size: [41, 37], pages: pages.clone(), ..plain };
    let values: Vec<f32> = pages.concat().iter().map(|value| *value as f32).collect();
    for (has_differences, big_endian) in [(false, false), (true, true)] {
        assert!(volume(&Stack { has_differences, big_endian, ..noisy.clone() }).0.values == values);
    }
    let signed = Stack { format: 2, pages: vec![vec![-5.0; 6]; 2], ..Stack::default() };
    assert!(volume(&signed).0.values.iter().all(|value| *value == -5.0));
}

#[test]
fn imagej_states_steps_channels_and_times() {
    let stack = |description: &str| Stack {
        description: format!("ImageJ=1.54f\n{description}\n"),
        resolution: Some(([4, 1], 1)),
        ..Stack::default()
    };
    let (grid, notes) = volume(&stack("images=4\nslices=4\nunit=\\u00B5m\nspacing=2.5"));
    assert_eq!(steps(&grid), DVec3::new(0.25, 0.25, 2.5));
    assert_eq!(notes.remarks, ["voxels of 0.25 x 0.25 x 2.5 µm, as the file says"]);
    // Two channels side by side, plane after plane.
    let two = stack("images=4\nchannels=2\nslices=2\nunit=cm\nspacing=1");
    let (grid, notes) = volume(&two);
    assert_eq!((grid.dims[2], grid.values[0], grid.values[6]), (2, 0.0, 12.0));
    assert!(notes.remarks[0].starts_with("channel1 of 2 is drawn; `array` of a scene"), "{:?}", notes.remarks);
    let second = ReadParams { array: Some("channel2".to_owned()), ..ReadParams::default() };
    let (grid, _) = read(&two.bytes(), &second).unwrap();
    assert_eq!((grid.values[0], grid.values[6]), (6.0, 18.0));
    let error = read(&stack("images=4\nslices=4").bytes(), &second).unwrap_err();
    assert!(error.to_string().contains("expected channel1, the only one, found 'channel2'"), "{error}");
    assert!(refused(&stack("images=4\nchannels=4")).contains("found 4 channels of one slice"));
    let times = stack("images=4\nslices=2\nframes=2");
    let (grid, _) = read(&times.bytes(), &ReadParams { frame: 1, ..ReadParams::default() }).unwrap();
    assert_eq!((grid.values[0], grid.values[6]), (12.0, 18.0));
    let (grid, notes) = volume(&stack("images=4\nframes=4"));
    assert!(grid.dims[2] == 4 && notes.remarks.iter().any(|r| r.contains("drawn as slices")), "{:?}", notes.remarks);
    assert!(
        refused(&stack("images=5\nslices=5"))
            .contains("expected 5 pages, as the description of the first says, found 4 pages")
    );
    assert!(refused(&stack("images=4\nslices=3")).contains("expected 4 images"));
    assert!(refused(&stack("images=4\nslices=none")).contains("'none'"));
    // What needs more than 4 GiB follows the first page without pages of its own.
    let mut long = stack("images=4\nslices=4");
    let behind = long.pages.split_off(1).concat();
    assert!(refused(&long).contains("expected 4 pages"));
    let mut content = long.bytes();
    let first: Vec<u8> = long.pages[0].iter().flat_map(|value| (*value as u16).to_le_bytes()).collect();
    // Both strips of the page move to the end, and all others follow.
    let starts = [8u32, 14].map(u32::to_le_bytes).concat();
    let there = content.windows(8).position(|window| window == starts).unwrap();
    let end = content.len() as u32;
    content[there..there + 8].copy_from_slice(&[end, end + 6].map(u32::to_le_bytes).concat());
    content.extend(first);
    content.extend(behind.iter().flat_map(|value| (*value as u16).to_le_bytes()));
    let (grid, _) = read(&content, &ReadParams::default()).unwrap();
    assert_eq!(grid.values, (0..24).map(|v| v as f32).collect::<Vec<_>>());
    content.pop();
    assert!(read(&content, &ReadParams::default()).is_err());
}

#[test]
fn ome_and_resolutions_state_steps() {
    let ome = |order: &str, sizes: &str| Stack {
        description: format!(
            "<?xml version=\"1.0\"?><OME xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\"><Image><Pixels DimensionOrder=\"{order}\" {sizes} \
             PhysicalSizeX=\"0.5\" PhysicalSizeY=\"0.25\" PhysicalSizeZ=\"2\"/></Image></OME>"
        ),
        ..Stack::default()
    };
    let (grid, notes) = volume(&ome("XYZCT", "SizeZ=\"4\""));
    assert_eq!(steps(&grid), DVec3::new(0.5, 0.25, 2.0));
    assert_eq!(notes.remarks, ["voxels of 0.5 x 0.25 x 2 µm, as the file says"]);
    let second = ReadParams { array: Some("channel2".to_owned()), ..ReadParams::default() };
    for (order, first) in [("XYZCT", 12.0), ("XYCZT", 6.0)] {
        let (grid, _) = read(&ome(order, "SizeZ=\"2\" SizeC=\"2\"").bytes(), &second).unwrap();
        assert_eq!(grid.values[0], first, "{order}");
    }
    let named = |names: [&str; 2]| {
        let plain = ome("XYZCT", "SizeZ=\"2\" SizeC=\"2\"");
        let channels = names.map(|name| format!("<Channel Name=\"{name}\"/>")).concat();
        let description =
            plain.description.replace("PhysicalSizeZ=\"2\"/>", &format!("PhysicalSizeZ=\"2\">{channels}</Pixels>"));
        Stack { description, ..plain }
    };
    let by_name = |name: &str| ReadParams { array: Some(name.to_owned()), ..ReadParams::default() };
    let (_, notes) = volume(&named(["DAPI", "GFP \u{b5}"]));
    assert_eq!(
        notes.remarks[0],
        "channel1 (DAPI) of 2 is drawn; `array` of a scene or --color-by chooses another by its name: channel2 (GFP \u{b5})"
    );
    for (name, first) in [("DAPI", 0.0), ("GFP \u{b5}", 12.0), ("channel2", 12.0)] {
        assert_eq!(read(&named(["DAPI", "GFP \u{b5}"]).bytes(), &by_name(name)).unwrap().0.values[0], first, "{name}");
    }
    let error = read(&named(["DAPI", ""]).bytes(), &by_name("RFP")).unwrap_err().to_string();
    assert!(error.contains("expected a channel among channel1 (DAPI), channel2, found 'RFP'"), "{error}");
    assert!(refused(&ome("XYZCT", "SizeZ=\"9\"")).contains("expected 9 pages"));
    assert!(refused(&ome("XYZZT", "SizeZ=\"4\"")).contains("expected a DimensionOrder"));
    assert!(
        refused(&Stack { description: "<OME><Pixels".to_owned(), ..Stack::default() }).contains("description by OME")
    );
    let inches = Stack { resolution: Some(([254, 1], 2)), ..Stack::default() };
    let (grid, notes) = volume(&inches);
    assert!(steps(&grid).distance(DVec3::splat(0.1)) < 1e-12);
    assert!(notes.remarks[0].starts_with("voxels of 0.1 x 0.1 mm by the resolution of the pages, and as deep as wide"));
    let (grid, notes) = volume(&Stack { resolution: Some(([254, 1], 1)), ..Stack::default() });
    assert_eq!(steps(&grid), DVec3::ONE);
    assert!(notes.remarks[0].starts_with("voxels of 1 x 1 x 1: no step is stated"));
}

#[test]
fn colours_are_their_luma_and_other_pages_are_refused() {
    let page: Vec<f64> = [[200.0, 100.0, 50.0]; 6].concat();
    let colors = Stack { bits: 8, numbers: 3, meaning: 2, pages: vec![page; 2], ..Stack::default() };
    let luma = (0.2126 * 200.0 + 0.7152 * 100.0 + 0.0722 * 50.0) as f32;
    assert!(volume(&colors).0.values.iter().all(|value| (value - luma).abs() < 1e-3));
    let one = Stack { pages: vec![vec![0.0; 6]], ..Stack::default() };
    assert!(
        refused(&one)
            .contains("expected a stack of two pages or more, found one page, a flat picture\nhint: name the folder")
    );
    let packed = Stack { packing: 7, ..Stack::default() };
    assert!(refused(&packed).contains("page 1") && refused(&packed).contains("save it without compression"));
    let half = Stack { bits: 16, format: 3, ..Stack::default() };
    let said = refused(&half);
    assert!(said.contains("expected floats of 32 or 64 bits, found floats of 16 bits at page 1"), "{said}");
    let infinite = Stack { bits: 32, format: 3, pages: vec![vec![f64::INFINITY; 6]; 2], ..Stack::default() };
    assert!(refused(&infinite).contains("expected values that fit 32-bit floats, found inf at voxel 0"));
}

/// Writes a slice of 10 x 2 ranks in a list of colours, of so many bits each.
fn listed(folder: &Path, name: &str, bits: u8, ranks: &[u8]) {
    let depth =
        [png::BitDepth::One, png::BitDepth::Two, png::BitDepth::Four, png::BitDepth::Eight][bits.ilog2() as usize];
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, 10, 2);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(depth);
    encoder.set_palette((0..3 << bits).map(|k| (255 - k % 256) as u8).collect::<Vec<u8>>());
    let pack = |ranks: &[u8]| {
        ranks.iter().enumerate().fold(0u8, |byte, (i, rank)| byte | rank << (8 - bits as usize * (i + 1)))
    };
    let rows = ranks.chunks(10).flat_map(|row| row.chunks(8 / usize::from(bits)).map(pack).collect::<Vec<u8>>());
    encoder.write_header().unwrap().write_image_data(&rows.collect::<Vec<u8>>()).unwrap();
    std::fs::write(folder.join(name), out).unwrap();
}

#[test]
fn slices_of_a_list_of_colours_are_ranks_in_it_of_any_depth() {
    for bits in [1u8, 2, 4, 8] {
        let path = folder(&format!("listed-{bits}"));
        let ranks: Vec<u8> = (0..40u16).map(|k| (k * 7 % (1 << bits)) as u8).collect();
        listed(&path, "s1.png", bits, &ranks[..20]);
        listed(&path, "s2.png", bits, &ranks[20..]);
        let (grid, notes) = of_folder(&path).unwrap();
        assert_eq!(grid.values, ranks.iter().map(|rank| f32::from(*rank)).collect::<Vec<_>>(), "{bits}");
        assert!(notes.remarks.iter().any(|remark| remark.starts_with("numbers stand for colours of a list")));
        // Cut short, and in the middle of its list.
        let whole = std::fs::read(path.join("s2.png")).unwrap();
        for end in [whole.len() / 4, whole.len() / 2, whole.len() - 13] {
            std::fs::write(path.join("s2.png"), &whole[..end]).unwrap();
            assert!(of_folder(&path).unwrap_err().to_string().contains("the slice 's2.png'"));
        }
    }
}

#[test]
fn a_size_of_voxels_is_that_of_the_request() {
    let size = |steps| ReadParams { voxel_size: read::VoxelSize::new(steps), ..ReadParams::default() };
    let bytes_of = Stack::default().bytes();
    let (grid, notes) = read(&bytes_of, &size([0.5, 0.25, 4.0])).unwrap();
    assert_eq!(steps(&grid).abs(), DVec3::new(0.5, 0.25, 4.0));
    let (plain, _) = read(&bytes_of, &ReadParams::default()).unwrap();
    assert_eq!(grid.origin, plain.origin * DVec3::new(0.5, 0.25, 4.0) / steps(&plain).abs());
    assert!(notes.remarks.iter().any(|r| r.starts_with("voxels of 0.5 x 0.25 x 4 by `voxel_size`")), "{notes:?}");
    assert_eq!(read::VoxelSize::new([1.0, f64::NAN, 1.0]), None);
    let error = bytes("a.xyz", b"0 0 1\n2 0 1\n", &size([1.0; 3]), None).unwrap_err().to_string();
    assert!(error.contains("expected a volume, found a file of another kind\nhint: leave out `voxel_size`"), "{error}");
}

/// A folder of this test, empty.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("slices-{name}"));
    // It is not there at the first run.
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn png(folder: &Path, name: &str, value: u8) {
    let image = GrayImage::from_fn(3, 2, |x, y| image::Luma([value + (x + 3 * y) as u8]));
    image.save_with_format(folder.join(name), ImageFormat::Png).unwrap();
}

fn of_folder(folder: &Path) -> Result<(Grid, Notes), ReadError> {
    file(folder, &ReadParams::default(), None).map(|(loaded, notes)| match loaded {
        Loaded::Grid(grid) => (grid, notes),
        _ => panic!("a volume"),
    })
}

#[test]
fn a_folder_of_slices_is_a_volume_in_the_order_of_its_numbers() {
    let pngs = folder("png");
    for number in [1u8, 2, 9, 10] {
        png(&pngs, &format!("s{number}.png"), 20 * number);
    }
    let error = of_folder(&pngs).unwrap_err().to_string();
    assert!(error.contains("expected the slice of number 3 behind 's2.png', found 's9.png'"), "{error}");
    for number in 3..9u8 {
        png(&pngs, &format!("s{number}.png"), 20 * number);
    }
    std::fs::write(pngs.join("notes.txt"), "of the day").unwrap();
    std::fs::write(pngs.join(".hidden.png"), "").unwrap();
    let (grid, notes) = of_folder(&pngs).unwrap();
    assert_eq!((grid.dims, notes.format.as_str()), ([3, 2, 10], "Slices"));
    let expected: Vec<f32> = (1..=10u16).flat_map(|z| (0..6).map(move |i| f32::from(20 * z + i))).collect();
    assert_eq!(grid.values, expected);
    assert_eq!(notes.unused, ["file notes.txt"]);
    assert_eq!(notes.remarks[0], "10 slices, 's1.png' to 's10.png'");
    assert!(notes.remarks[1].starts_with("voxels of 1 x 1 x 1: the files state no step"), "{:?}", notes.remarks);
    assert_eq!(read::files_of(&pngs).unwrap().len(), 11);
    // Unlike sizes and types are refused by name.
    RgbImage::new(3, 2).save_with_format(pngs.join("s5.png"), ImageFormat::Png).unwrap();
    let error = of_folder(&pngs).unwrap_err().to_string();
    assert!(error.contains("expected slices like the first, 's1.png', of 3 x 2 pixels of 1 x u8, found 3 x 2 pixels of 3 x u8 in 's5.png'"), "{error}");
    std::fs::write(pngs.join("s5.png"), "no picture").unwrap();
    assert!(of_folder(&pngs).unwrap_err().to_string().contains("the slice 's5.png': a Png file"));
    std::fs::write(pngs.join("s5.tif"), Stack::default().bytes()).unwrap();
    assert!(of_folder(&pngs).unwrap_err().to_string().contains("slices of one format"));

    let tiffs = folder("tiff");
    for (z, page) in Stack::default().pages.into_iter().enumerate() {
        let slice =
            Stack { pages: vec![page], resolution: Some(([10, 2], 3)), big_endian: z % 2 == 1, ..Stack::default() };
        std::fs::write(tiffs.join(format!("z{z:03}.TIF")), slice.bytes()).unwrap();
    }
    let (grid, notes) = of_folder(&tiffs).unwrap();
    assert_eq!(grid.values, (0..24).map(|v| v as f32).collect::<Vec<_>>());
    assert_eq!(steps(&grid), DVec3::splat(2.0));
    assert!(notes.remarks[1].contains("by the resolution of the first slice"), "{:?}", notes.remarks);
    std::fs::write(tiffs.join("z004.TIF"), Stack::default().bytes()).unwrap();
    assert!(
        of_folder(&tiffs)
            .unwrap_err()
            .to_string()
            .contains("the slice 'z004.TIF': one slice a file, of one page, found 4 pages")
    );
    let deep = folder("deep");
    let page = DynamicImage::ImageLuma16(image::ImageBuffer::from_fn(3, 2, |x, _| image::Luma([1000 * x as u16])));
    for name in ["a1.png", "a2.png"] {
        page.save_with_format(deep.join(name), ImageFormat::Png).unwrap();
    }
    assert_eq!(of_folder(&deep).unwrap().0.values[..3], [0.0, 1000.0, 2000.0]);
}

#[cfg(unix)]
#[test]
fn a_slice_that_is_a_link_out_of_its_folder_is_refused() {
    let folder = folder("links");
    let outside = folder.join("outside");
    let inside = folder.join("inside");
    for folder in [&outside, &inside] {
        std::fs::create_dir(folder).unwrap();
    }
    png(&outside, "a1.png", 0);
    png(&inside, "a2.png", 0);
    std::os::unix::fs::symlink(outside.join("a1.png"), inside.join("a1.png")).unwrap();
    let error = of_folder(&inside).unwrap_err().to_string();
    assert!(error.contains("found 'a1.png', a link out of it"), "{error}");
}
