//! Recordings that draw: their text, their barriers, and how they are joined.

use splat_shaders::{
    Barrier, Blend, BufferId, Corners, Format, Groups, ImageId, Recording, Resource, Target, Use, barriers, kernels,
    programs,
};

/// Two draws into one pair of images, the first of which clears, and copies that are read.
fn drawn() -> (Recording, [BufferId; 3], [ImageId; 2]) {
    let mut r = Recording::default();
    let [read, strips] = [r.input("read", 64), r.input("strips", 16)];
    let images = [r.image("color", [5, 3], Format::Rgba16F), r.image("sum", [5, 3], Format::R32F)];
    let [colors, sums] = images.map(|image| r.images()[image.index()].copy_bytes());
    let copies = [r.scratch("colors", colors), r.scratch("sums", sums)];
    for clear in [Some([0.0, 0.0, 0.0, 1.0]), None] {
        let target = |at: usize, blend| Target { image: images[at], blend, clear };
        let targets = [target(0, Blend::Under), target(1, Blend::Add)];
        let corners = Corners::Indirect { buffer: strips, offset: 0 };
        r.draw(&programs::SPLAT_DRAW, corners, &[read; 6], &[0, 1, 2, 3], &targets);
    }
    (0..2).for_each(|k| r.copy(images[k], copies[k]));
    r.read(copies[0]);
    (r, [read, strips, copies[0]], images)
}

#[test]
fn a_drawing_is_as_kept_in_text() {
    let (r, ..) = drawn();
    r.check().unwrap();
    let text = "\
buffer  0 read             64 bytes
buffer  1 strips           16 bytes
buffer  2 colors           768 bytes
buffer  3 sums             768 bytes
image   0 color            5x3 Rgba16F
image   1 sum              5x3 R32F
upload read
upload strips
splat_draw strips@0 read read read read read read 0 1 2 3 Under color* from [0.0, 0.0, 0.0, 1.0] Add sum* from [0.0, 0.0, 0.0, 1.0]
splat_draw strips@0 read read read read read read 0 1 2 3 Under color* Add sum*
copy color colors*
copy sum sums*
read colors
";
    assert_eq!(r.to_string(), text);
    // Rows of a copy begin at multiples of 256 bytes; images take 8 and 4 bytes a pixel.
    assert_eq!(r.bytes(), 64 + 16 + 2 * 768 + 15 * 12);
}

#[test]
fn draws_wait_for_what_they_read_and_images_change_their_layout() {
    let (mut r, [read, strips, _], [color, _]) = drawn();
    // Another draw after the copies, which clears: it waits for them all the same.
    let target = |blend| Target { image: color, blend, clear: Some([0.0; 4]) };
    r.draw(&programs::SPLAT_DRAW, Corners::Direct([4, 1]), &[read; 6], &[0; 4], &[target(Blend::Over); 2]);
    let waits = barriers(&r);
    let wait = |of, from, to| Barrier { of, from, to };
    let [b, s] = [read, strips].map(Resource::Buffer);
    let i = Resource::Image(color);
    assert_eq!(
        waits[2][..6],
        [wait(b, Use::CopyWrite, Use::DrawRead); 6],
        "each binding waits; the size and both images do too"
    );
    assert!(waits[2].contains(&wait(s, Use::CopyWrite, Use::Indirect)));
    assert!(waits[2].contains(&wait(i, Use::Nothing, Use::Target)));
    assert!(waits[3].contains(&wait(i, Use::Target, Use::Target)) && waits[3].len() == 2, "{:?}", waits[3]);
    assert_eq!(waits[4], [wait(i, Use::Target, Use::CopyRead)]);
    // One change of layout, from that of the copy.
    let of_image: Vec<_> = waits[7].iter().filter(|w| w.of == i).collect();
    assert_eq!(of_image[0], &wait(i, Use::CopyRead, Use::Target));
}

#[test]
fn joined_drawings_keep_images_of_their_own() {
    let mut whole = Recording::default();
    let view = whole.input("first", 64);
    let state = whole.scratch("state", 4);
    whole.dispatch(&kernels::SPLAT_NOTHING, Groups::cover(1), &[state], &[]);
    let (other, [read, _, colors], _) = drawn();
    let first = whole.join(&other, &[(read, view)]);
    let second = whole.join(&other, &[(read, view)]);
    whole.check().unwrap();
    assert_eq!(whole.images().len(), 4);
    assert_ne!(first.of(colors), second.of(colors));
    let text = whole.to_string();
    assert_eq!(text.matches("splat_draw strips@0 first first").count(), 4);
    let targets: Vec<usize> = whole
        .steps()
        .iter()
        .filter_map(|step| match step {
            splat_shaders::Step::Draw(draw) => Some(draw.targets[1].image.index()),
            _ => None,
        })
        .collect();
    assert_eq!(targets, [1, 1, 3, 3]);
    // The first wait of each draw's images is for nothing.
    let nothing = barriers(&whole).concat().iter().filter(|w| w.from == Use::Nothing).count();
    assert_eq!(nothing, 4);
}
