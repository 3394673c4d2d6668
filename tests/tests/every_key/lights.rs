//! Keys of lights.

use super::table::{Entry, Look, SPOT, SUN, one};

pub(crate) fn entries() -> Vec<Entry> {
    let mut all = vec![
        one("light", "light=[]"),
        one("light.spot.target", "light.0.target=[0.5, 0, 0]").with(SPOT),
        one("light.spot.direction", "light.0.direction=[-2, -3, -2.6]").with(AIMED),
        one("light.spot.inner", "light.0.inner=15").with(SPOT),
        one("light.spot.outer", "light.0.outer=12").with(SPOT),
        one("light.directional.direction", "light.0.direction=[-2, -3, -1]").with(SUN),
        one("light.directional.irradiance", "light.0.irradiance=[1, 1, 1]").with(SUN),
        one("light.directional.shadow", "light.0.shadow=false").with(SUN),
        one("light.directional.shadow_cells", "light.0.shadow_cells=2").with(SUN),
        one("light.spot.texture", "light.0.texture='sky.hdr'").with(SPOT),
        one("light.spot.texture_up", "light.0.texture_up=[1, 0, 0]").with(SLIDE),
        one("light.spot.texture_angle", "light.0.texture_angle=60").with(SLIDE),
        one("light.directional.texture", "light.0.texture='bright.hdr'").with(SUN_SLIDE),
        one("light.directional.texture_up", "light.0.texture_up=[1, 0, 0]").with(SUN_SLIDE),
        one("light.directional.texture_width", "light.0.texture_width=6").with(SUN_SLIDE),
        one("light.directional.texture_center", "light.0.texture_center=[0.3, 0.2, 0]").with(SUN_SLIDE),
        one("light.disk.normal", "light.0.normal=[-1, 0, 0]").with(DISK),
        one("light.rect.u", "light.0.u=[0.1, 0, -0.6]").with(RECT),
        one("light.rect.v", "light.0.v=[0.6, -0.2, 0]").with(RECT),
    ];
    for (kind, with) in
        [("directional", SUN), ("point", &[][..]), ("spot", SPOT), ("sphere", SPHERE), ("disk", DISK), ("rect", RECT)]
    {
        let key: &'static str = format!("light.{kind}.name").leak();
        all.push(one(key, "light.0.name='key'").with(with).look(Look::Told));
    }
    for (kind, with) in [("point", &[][..]), ("spot", SPOT), ("sphere", SPHERE), ("disk", DISK), ("rect", RECT)] {
        let key = |name: &str| -> &'static str { format!("light.{kind}.{name}").leak() };
        all.push(one(key("position"), "light.0.position=[2, 2.9, 2]").with(with));
        all.push(one(key("intensity"), "light.0.intensity=[10, 10, 10]").with(with));
        all.push(one(key("shadow"), "light.0.shadow=false").with(with));
        all.push(one(key("shadow_cells"), "light.0.shadow_cells=2").with(with));
        if matches!(kind, "sphere" | "disk" | "rect") {
            all.push(one(key("samples"), "light.0.samples=9").with(with));
        }
        if matches!(kind, "sphere" | "disk") {
            all.push(one(key("radius"), "light.0.radius=0.6").with(with));
        }
    }
    all
}

const AIMED: &[&str] =
    &["light=[{kind='spot', position=[2, 3, 2], direction=[-2, -3, -2], outer=20, intensity=[20, 18, 16]}]"];
const SLIDE: &[&str] = &[SPOT[0], "light.0.texture='sky.hdr'"];
const SUN_SLIDE: &[&str] = &[SUN[0], "light.0.texture='sky.hdr'", "light.0.texture_width=5"];
const DISK: &[&str] =
    &["light=[{kind='disk', position=[2, 3, 2], normal=[-1, -1, -1], radius=0.3, intensity=[20, 18, 16], samples=4}]"];
const RECT: &[&str] = &[
    "light=[{kind='rect', position=[2, 3, 2], u=[0.1, 0, -0.3], v=[0.3, -0.2, 0], intensity=[20, 18, 16], samples=4}]",
];
const SPHERE: &[&str] = &["light=[{kind='sphere', position=[2, 3, 2], radius=0.3, intensity=[20, 18, 16], samples=4}]"];
