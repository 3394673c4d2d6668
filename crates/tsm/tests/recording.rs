//! The recorded lists and look-ups, without a device: what they are, and what they refuse.

use crate::common::{self, mixed, point_light};
use splat_core::SplatKind;
use splat_core::glam::DVec3;
use splat_core::raster::gpu::AttributeRoom;
use splat_shaders::Overflow;
use tsm::gpu::{Capacities, CastRoom, Casting, Room, record, record_cast, record_look_up, record_map, record_shadow};
use tsm::{Deposits, Error, Params, ShadowMap};

const ROOM: Capacities = Capacities { entries: 200_000, cells: 2 * 120 * 120, channels: 3 };

fn deposits() -> Deposits {
    let light = point_light(DVec3::new(0.3, 2.5, 0.2));
    Deposits::new(&tsm::Scene::from(&mixed(4000, DVec3::ZERO)), &light, &Params::default(), None).unwrap()
}

#[test]
fn the_lists_are_as_kept_in_text() {
    let found = record(ROOM).recording.to_string();
    assert_eq!(found, include_str!("recording.txt"), "now:\n{found}");
}

#[test]
fn look_ups_are_as_kept_in_text() {
    let map = deposits().into_map();
    let room = Room { entries: 100_000, ..Room::for_map(&map, 5000).unwrap() };
    let recorded = record_look_up(Room { cells: 6000, directions: 1500, ..room });
    let found = recorded.recording.to_string();
    assert_eq!(found, include_str!("look_up.txt"), "now:\n{found}");
    recorded.recording.check().unwrap();
}

#[test]
fn look_ups_refuse_what_they_have_no_room_for() {
    let map = deposits().into_map();
    let room = Room::for_map(&map, 10).unwrap();
    let refused = |room| record_look_up(room).map(&map).unwrap_err();
    assert!(record_look_up(room).map(&map).is_ok());
    assert!(matches!(refused(Room { cells: room.cells - 1, ..room }), Error::Overflow(Overflow { what: "cells", .. })));
    assert!(matches!(
        refused(Room { entries: room.entries - 1, ..room }),
        Error::Overflow(Overflow { what: "entries", .. })
    ));
    assert!(matches!(refused(Room { opaque: false, ..room }), Error::Overflow(Overflow { what: "opaque discs", .. })));
    assert!(matches!(refused(Room { channels: 3, ..room }), Error::Overflow(Overflow { what: "channels", .. })));
    let recorded = record_look_up(room);
    let uploads = recorded.map(&map).unwrap();
    let receivers = [crate::common::probe(splat_core::glam::Vec3::X); 11];
    let refused = recorded.receivers(&map, &uploads, &receivers).unwrap_err();
    assert_eq!(refused, Error::Overflow(Overflow { what: "receivers", needed: 11, had: 10 }));
    let ten = recorded.receivers(&map, &uploads, &receivers[..10]).unwrap();
    assert_eq!(recorded.inputs(None, &ten).len() + 5, recorded.inputs(Some(&uploads), &ten).len());
    let short = recorded.transmittances(&[0; 36], &ten).unwrap_err();
    assert_eq!(short, Error::ReadBack { what: "lights", expected: 40, found: 36 });
    assert_eq!(recorded.transmittances(&[0; 40], &ten).unwrap(), [[0.0; 3]; 10]);
    // Polar angles are the CPU's.
    let polar = Params { mapping: tsm::MappingChoice::PolarAzimuth, ..Params::default() };
    let light = point_light(DVec3::new(0.3, 2.5, 0.2));
    assert_eq!(Room::for_map(&crate::common::build(&mixed(100, DVec3::ZERO), &light, &polar), 10), None);
}

#[test]
fn the_lists_that_look_ups_are_given_are_those_of_the_map() {
    let light = point_light(DVec3::new(0.3, 2.5, 0.2));
    let mixed_cloud = mixed(4000, DVec3::ZERO);
    for kinds in
        [&[SplatKind::Medium, SplatKind::Surface, SplatKind::Opaque][..], &[SplatKind::Medium], &[SplatKind::Surface]]
    {
        let mut cloud = splat_core::Cloud::new(DVec3::ZERO);
        (0..mixed_cloud.len())
            .filter(|i| kinds.contains(&mixed_cloud.kind[*i]))
            .for_each(|i| cloud.push(&mixed_cloud.get(i)));
        let map = common::build(&cloud, &light, &Params::default());
        let shared = compare_lists(&map, kinds.contains(&SplatKind::Opaque));
        assert!((shared > 100) == (kinds.len() > 1), "{kinds:?}: {shared} entries beside others of the same cell");
    }
}

/// Compares all lists that a device is given with those that the map tells; how many entries stand beside others of their cell.
fn compare_lists(map: &ShadowMap, has_opaque: bool) -> usize {
    let recorded = record_look_up(Room::for_map(map, 1).unwrap());
    let uploads = recorded.map(map).unwrap();
    let receivers = recorded.receivers(map, &uploads, &[]).unwrap();
    let given = recorded.inputs(Some(&uploads), &receivers);
    let [.., spans, distances, totals, opaque, _] = &given[..] else { panic!("{} buffers", given.len()) };
    let numbers = |bytes: &[u8]| bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect::<Vec<_>>();
    let spans: Vec<usize> = spans.1.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b) as usize).collect();
    let [distances, totals, opaque] = [distances, totals, opaque].map(|(_, bytes)| numbers(bytes));
    let channels = map.channels();
    let cells = map.cells() as usize;
    assert_eq!((spans.len(), totals.len()), (4 * cells, channels * distances.len()));
    assert_eq!(opaque.len(), if has_opaque { cells } else { 0 });
    let mut shared = 0;
    let mut unit = 0.0;
    for cell in 0..cells {
        // Lists of media, then of surfaces, and where an opaque disc ends them.
        let lists = [cell, cells + cell].map(|list| spans[2 * list]..spans[2 * list] + spans[2 * list + 1]);
        let mut found: Vec<f64> = lists.iter().flat_map(|l| &distances[l.clone()]).map(|d| f64::from(*d)).collect();
        found.sort_by(f64::total_cmp);
        found.extend(opaque.get(cell).map(|d| f64::from(*d)).filter(|d| d.is_finite()));
        let expected = map.list(cell as u32);
        assert_eq!(found.len(), expected.len(), "cell {cell}");
        for (found, (expected, _)) in found.iter().zip(&expected) {
            let ratio = expected / found;
            assert!(unit == 0.0 || unit == ratio, "cell {cell}: {expected} in units of {unit}, not {found}");
            unit = ratio;
        }
        let last = |l: &std::ops::Range<usize>| f64::from(totals[channels * (l.end - 1)]);
        let whole: f64 = lists.iter().filter(|l| !l.is_empty()).map(last).sum();
        let sums = expected.iter().rev().map(|(_, sum)| f64::from(sum[0]));
        let expected = sums.into_iter().find(|sum| sum.is_finite()).unwrap_or(0.0);
        assert!((whole - expected).abs() <= 1e-5 * expected, "cell {cell}: {whole}, not {expected}");
        shared += lists.iter().map(|l| l.len()).min().unwrap_or(0);
    }
    shared
}

#[test]
fn they_are_without_fault_for_any_room() {
    for entries in [0, 1, 1023, 1025, 5_000_000, 100_000_000, u32::MAX] {
        for cells in [0, 1, 2, 257, 1 << 21] {
            for channels in [1, 3] {
                record(Capacities { entries, cells, channels }).recording.check().unwrap();
            }
        }
    }
}

#[test]
fn too_little_room_says_how_much() {
    let deposits = deposits();
    let most = Capacities { entries: u32::MAX, cells: u32::MAX, channels: 1 };
    let batches = deposits.batches(most).unwrap();
    let [all] = &batches[..] else { panic!("{batches:?}") };
    assert_eq!(all.entries(), deposits.entries().iter().sum::<u64>());
    let entries = all.entries() as u32;
    let cells = all.cells() as u32;
    let refused = |room| record(room).uploads(&deposits, all).unwrap_err();
    let overflow =
        |what, needed: u32, had: u32| Error::Overflow(Overflow { what, needed: needed.into(), had: had.into() });
    let room = Capacities { entries, cells, channels: 1 };
    assert_eq!(refused(Capacities { entries: entries - 1, ..room }), overflow("entries", entries, entries - 1));
    assert_eq!(refused(Capacities { cells: cells - 1, ..room }), overflow("cells", cells, cells - 1));
    assert_eq!(refused(Capacities { channels: 3, ..room }), overflow("channels", 1, 3));
    assert!(record(room).uploads(&deposits, all).is_ok());
}

#[test]
fn batches_are_all_cells_in_order_and_small_enough() {
    let deposits = deposits();
    let total: u64 = deposits.entries().iter().sum();
    for (entries, cells) in [(total as u32 / 4, 4000), (total as u32, 10_000), (total as u32 / 3, 1 << 30)] {
        let batches = deposits.batches(Capacities { entries, cells, channels: 1 }).unwrap();
        assert!(batches.len() > 2, "{}", batches.len());
        assert!(batches.iter().all(|b| b.entries() <= entries.into() && b.cells() <= cells.into()));
        assert_eq!(batches.iter().map(|b| b.entries()).sum::<u64>(), total);
    }
    let refused = deposits.batches(Capacities { entries: 3, cells: 1 << 30, channels: 1 });
    assert!(matches!(refused, Err(Error::Overflow(Overflow { what: "entries", had: 3, .. }))), "{refused:?}");
}

#[test]
fn bytes_that_no_run_gave_are_refused() {
    let deposits = deposits();
    let most = Capacities { entries: u32::MAX, cells: u32::MAX, channels: 1 };
    let batch = &deposits.batches(most).unwrap()[0];
    let entries = batch.entries() as usize;
    let cells = batch.cells() as usize;
    let recorded = record(Capacities { entries: entries as u32, cells: cells as u32, channels: 1 });
    // Empty lists: those of surfaces begin behind the entries of media.
    let of_media = deposits.entries()[0] as u32;
    let empty = |cell| [if cell < cells / 2 { 0 } else { of_media }, 0].map(u32::to_ne_bytes).concat();
    let spans = (0..cells).flat_map(empty).collect::<Vec<u8>>();
    let column = vec![0u8; 4 * entries];
    let short = |what, expected: usize, found: usize| {
        Err(Error::ReadBack { what, expected: expected as u64, found: found as u64 })
    };
    assert_eq!(recorded.listed([&spans[1..], &column, &column], batch), short("spans", 8 * cells, 8 * cells - 1));
    assert_eq!(
        recorded.listed([&spans, &column[4..], &column], batch),
        short("distances", 4 * entries, 4 * entries - 4)
    );
    assert_eq!(recorded.listed([&spans, &column, &[]], batch), short("totals", 4 * entries, 0));
    let good = recorded.listed([&spans, &column, &column], batch).unwrap();
    deposits.join(vec![good.clone()]).unwrap();
    // None, one too many, and lists that reach beyond the entries.
    assert!(matches!(deposits.join(Vec::new()), Err(Error::ReadBack { what: "spans", .. })));
    assert!(matches!(deposits.join(vec![good.clone(), good]), Err(Error::ReadBack { what: "spans", .. })));
    let beyond = recorded.listed([&vec![255u8; 8 * cells], &column, &column], batch).unwrap();
    assert!(matches!(deposits.join(vec![beyond]), Err(Error::ReadBack { what: "spans", .. })));
}

#[test]
fn the_most_room_fits_and_more_does_not() {
    let largest = |room| record(room).recording.buffers().iter().map(|b| b.bytes).max();
    for bytes in [1024u64, 4096, 65_536, 128 << 20] {
        for channels in [1, 3] {
            let most = Capacities::most(bytes, channels);
            if bytes == 1024 && channels == 3 {
                assert_eq!((most.entries, most.cells), (0, 0));
                continue;
            }
            assert!(largest(most) <= Some(bytes), "{bytes}: {most:?}");
            let more = [Capacities { entries: most.entries + 1, ..most }, Capacities { cells: most.cells + 1, ..most }];
            assert!(more.into_iter().all(|room| largest(room) > Some(bytes)), "{bytes}: {most:?}");
        }
    }
}

const CAST: CastRoom = CastRoom {
    attributes: AttributeRoom { splats: 5000, frame_words: 3 },
    casters: 4000,
    entries: 200_000,
    cells: 2 * 120 * 120,
    channels: 1,
    directions: 60 * 60,
    opaque: true,
    planes: true,
    tables: 5,
};

fn casting(params: &Params) -> Result<Casting, Error> {
    let light = point_light(DVec3::new(0.3, 2.5, 0.2));
    Casting::new(&tsm::Scene::from(&mixed(4000, DVec3::ZERO)), &light, params, None)
}

#[test]
fn deposits_are_as_kept_in_text() {
    let [grey, coloured] = [1, 3].map(|channels| record_cast(CastRoom { channels, ..CAST }).recording.to_string());
    assert_eq!(grey, include_str!("deposits.txt"), "now:\n{grey}");
    let absorbances = |bytes: u32| format!("absorbances      {bytes} bytes");
    assert_eq!(coloured, grey.replace(&absorbances(800_000), &absorbances(2_400_000)));
}

#[test]
fn a_shadow_is_uploaded_as_splats_and_nothing_of_its_map_comes_back() {
    let recorded = record_shadow(CAST, 1);
    let steps = recorded.recording.to_string();
    let named = |what: &str| -> Vec<String> {
        steps.lines().filter_map(|line| line.strip_prefix(what)).map(str::to_owned).collect()
    };
    let uploads = [
        ["cast view", "positions", "radii", "looks", "frames", "casters", "cast tables", "cast scan"],
        ["list view", "opaque discs", "directions", "cells", "distances", "absorbances", "view", "shadow shares"],
    ];
    assert_eq!(named("upload "), uploads.concat());
    assert_eq!(named("read "), ["cast state", "received"]);
    // Light of two lamps.
    assert_eq!(recorded.recording.buffers()[recorded.received.index()].bytes, 2 * 12 * 5000);
}

#[test]
fn maps_and_shadows_are_without_fault_for_any_room() {
    for (entries, cells, splats) in [(0, 0, 0), (1, 2, 1), (1025, 514, 257), (100_000_000, 1 << 21, 5_000_000)] {
        for (channels, planes) in [(1, false), (1, true), (3, true)] {
            let attributes = AttributeRoom { splats, frame_words: 0 };
            let room = CastRoom { attributes, casters: splats, entries, cells, channels, planes, ..CAST };
            record_map(room).recording.check().unwrap();
            record_shadow(room, 0).recording.check().unwrap();
        }
    }
}

#[test]
fn deposits_refuse_what_they_have_no_room_for() {
    let casting = casting(&Params::default()).unwrap();
    let attributes = AttributeRoom { splats: 4000, frame_words: 3 };
    let room = casting.room(attributes, casting.expected());
    assert!(casting.casters() > 1000 && casting.given() > 0 && room.opaque && room.planes);
    let refused = |room, ids: Option<&[u32]>| match record_cast(room).uploads(&casting, ids) {
        Err(Error::Overflow(Overflow { what, .. })) => what,
        other => panic!("{other:?}"),
    };
    assert!(record_cast(room).uploads(&casting, None).is_ok());
    assert_eq!(refused(CastRoom { casters: room.casters - 1, ..room }, None), "casters");
    assert_eq!(refused(CastRoom { entries: casting.given() as u32 - 1, ..room }, None), "entries");
    assert_eq!(refused(CastRoom { cells: room.cells - 1, ..room }, None), "cells");
    assert_eq!(refused(CastRoom { opaque: false, ..room }, None), "opaque discs");
    assert_eq!(refused(CastRoom { planes: false, ..room }, None), "planes");
    assert_eq!(refused(CastRoom { channels: 3, ..room }, None), "channels");
    // Casters that are not among the splats.
    let few = AttributeRoom { splats: 10, ..attributes };
    assert_eq!(refused(CastRoom { attributes: few, ..room }, None), "casters among splats");
    assert_eq!(refused(room, Some(&[0, 1, 2])), "casters among splats");
    let shares = record_shadow(room, 0).uploads(&casting, None, &[1.0, 0.5]).unwrap_err();
    assert_eq!(shares, Error::Overflow(Overflow { what: "shares of shadows", needed: 2, had: 4000 }));
    let recorded = record_cast(CastRoom { entries: 7, ..room });
    assert_eq!(
        recorded.found(&8u32.to_ne_bytes()),
        Err(Error::Overflow(Overflow { what: "entries", needed: 8, had: 7 }))
    );
    assert_eq!(recorded.found(&7u32.to_ne_bytes()), Ok(7));
    assert_eq!(recorded.found(&[7]), Err(Error::ReadBack { what: "cast state", expected: 4, found: 1 }));
}

#[test]
fn what_devices_do_not_deposit_is_refused_or_given() {
    let polar = Params { mapping: tsm::MappingChoice::PolarAzimuth, ..Params::default() };
    assert!(matches!(casting(&polar), Err(Error::Processor { .. })));
    let absorbance = splat_core::optics::AbsorbanceModel::Paper;
    let paper = casting(&Params { absorbance, ..Params::default() }).unwrap();
    assert!(paper.casters() == 0 && paper.given() > 0);
    let total = deposits().entries().iter().sum::<u64>();
    let default = casting(&Params::default()).unwrap();
    assert!(default.given() < total && u64::from(default.expected()) * 2 > total);
}
