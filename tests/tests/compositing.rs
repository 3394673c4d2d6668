//! Pictures without their background, laid over another one.

use organza_tests::{Picture, Place, hdr, largest_difference, picture_of};

/// Fog, a pane and a ball before a background, all lit; `background` is its table.
fn scene(background: &str, technique: &str) -> String {
    format!(
        "version = 1\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nfov_y = 60\nsize = [32, 24]\n\
         [background]\n{background}\n\
         [[light]]\nkind = 'point'\nposition = [2, 4, 3]\nintensity = [20, 20, 20]\n\
         [[object]]\nname = 'fog'\nmedium_ball = {{ center = [-0.5, 0, 0], radius = 0.8, extinction = 0.9, spacing = 0.1 }}\n\
         [[object]]\nname = 'pane'\nopacity = 0.5\n\
         rectangle = {{ center = [0.5, 0, 0.5], u = [0.5, 0, 0.2], v = [0, 0.8, 0], spacing = 0.1 }}\n\
         [[object]]\nname = 'wall'\nrectangle = {{ center = [0, -0.7, -0.5], u = [1, 0, 0], v = [0, 0.3, 0], spacing = 0.1 }}\n\
         [render]\ntechnique = '{technique}'\nparticles = {{ repeat_level = 8 }}\n"
    )
}

fn draw(place: &Place, scene: &str, arguments: &[&str]) -> Picture {
    place.write("s.toml", scene);
    place.expect(0, &[&["render", "s.toml", "-o", "a.exr", "--force"], arguments].concat(), "");
    picture_of(&place.path("a.exr"))
}

#[test]
fn objects_over_another_background_are_the_picture_that_is_drawn_before_it() {
    let place = Place::new("");
    place.write("sky.hdr", hdr([16, 8], |x, y| [(8 * x) as u8, (16 * y) as u8, 200, 129]));
    for technique in ["points", "particles", "sheets"] {
        let plate = [0.75, 0.5, 0.25];
        let whole = draw(&place, &scene("color = [0.75, 0.5, 0.25]", technique), &[]);
        assert!(whole.channel("A").iter().all(|a| *a == 1.0), "a picture with a background is opaque");
        for background in ["color = [0.2, 0.4, 0.8]", "environment = 'sky.hdr'", "color = [0, 0, 0]"] {
            let objects = draw(&place, &scene(background, technique), &["--transparent"]);
            let alpha = objects.channel("A");
            let empty = alpha.iter().enumerate().filter(|(_, a)| **a == 0.0).map(|(pixel, _)| pixel);
            for (channel, plate) in ["R", "G", "B"].into_iter().zip(plate) {
                let light = objects.channel(channel);
                // An opacity of less than half a unit in the last place of 1 is 0, and still has some light.
                assert!(empty.clone().count() > 50 && empty.clone().all(|pixel| light[pixel] < 1e-7));
                let over: Vec<f64> = light.iter().zip(&alpha).map(|(light, a)| light + (1.0 - a) * plate).collect();
                let off = largest_difference(&over, &whole.channel(channel));
                assert!(off < 4e-6, "{technique}, {background}, {channel}: {off:e}");
            }
        }
        // Without a background both forms are one.
        let plain = draw(&place, &scene("color = [0, 0, 0]", technique), &[]);
        assert_eq!(plain.channel("A"), whole.opacity());
    }
}
