//! A small file of each format and kind, by its name: for damage, and as seeds of fuzzing.

use crate::read_samples::archives::{gaussian_glb, ksplat, sog, spz_glb};
use crate::read_samples::cells::{vtk_cells, vtk_surface, vtp, vtp_pieces, vtu, vtu_pieces};
use crate::read_samples::copc::copc;
use crate::read_samples::e57::e57;
use crate::read_samples::gaussians::{packed_ply, splat, spz, spz_4, trained, trained_ply};
use crate::read_samples::grids::{
    vtk_polyhedra, vtk_rectilinear, vtk_structured, vtr, vts, vtu_polyhedra, vtu_quadratic,
};
use crate::read_samples::oldest::laz_oldest;
use crate::read_samples::stacks::Stack;
use crate::read_samples::volumes::{self, metaimage, vti, vtk, vtk_scalars};
use crate::read_samples::{
    NIFTI_F32, gzip, image, images, las, nifti, nrrd, obj, off, pcd, plain_glb, ply_ascii, ply_binary, square_glb, stl,
    text_points,
};
use exr::prelude::{Blocks, Compression, Vec2};
use image::ImageFormat;
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, FootprintStack, Splat, SplatKind};

/// Files that end where they have to.
pub(crate) fn samples() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("ascii.ply", ply_ascii().into_bytes()),
        ("little.ply", ply_binary(false)),
        ("big.ply", ply_binary(true)),
        ("packed.ply.gz", gzip(&ply_binary(false))),
        ("u.nii", nifti(NIFTI_F32, false)),
        ("b.nii", nifti(NIFTI_F32, true)),
        ("p.nii.gz", gzip(&nifti(NIFTI_F32, false))),
        ("f3.las", las(3, 20, false)),
        ("f7.las", las(7, 20, false)),
        ("f3.laz", las(3, 20, true)),
        ("f7.laz", las(7, 20, true)),
        ("old.laz", laz_oldest(1, 20)),
        ("scans.e57", e57()),
        ("b.stl", stl(true)),
        ("a.off", off()),
        ("text.pcd", pcd("ascii")),
        ("bytes.pcd", pcd("binary")),
        ("packed.pcd", pcd("binary_compressed")),
        ("plain.glb", plain_glb()),
        ("raw.nrrd", nrrd("raw")),
        ("gz.nrrd", nrrd("gzip")),
        ("packed.nrrd.gz", gzip(&nrrd("gzip"))),
        ("raw.mha", metaimage("raw", true)),
        ("zlib.mha", metaimage("zlib", false)),
        ("ascii.vti", vti("ascii", false)),
        ("binary.vti", vti("binary", false)),
        ("rawblocks.vti", vti("raw", true)),
        ("base64blocks.vti", vti("base64", true)),
        ("binary.vtk", vtk_scalars(true)),
        ("steps.vtr", vtr()),
        ("steps.vtk", vtk_rectilinear(true)),
        ("straight.vts", vts(0.0)),
        ("colours.vtp", vtp()),
        ("pieces.vtp", vtp_pieces()),
        ("a_3x2x2_float32.raw", volumes::raw(false)),
        ("newer.hdr", images::hdr_of("EXPOSURE=0.5\n", &images::newer())),
        ("older.hdr", images::hdr_of("", &images::older())),
        ("lines.exr", images::exr(Compression::ZIP16, Blocks::ScanLines)),
        ("tiles.exr", images::exr(Compression::PIZ, Blocks::Tiles(Vec2(8, 4)))),
        ("plain.exr", images::exr(Compression::Uncompressed, Blocks::ScanLines)),
        ("a.png", images::png(image::ExtendedColorType::Rgb8, &images::png_bytes(3))),
        ("strips.tif", Stack::default().bytes()),
        ("lzw.tif", Stack { packing: 5, has_differences: true, big_endian: true, ..Stack::default() }.bytes()),
        ("tiles.tiff", Stack { packing: 8, tile: 16, is_wide: true, bits: 32, format: 3, ..Stack::default() }.bytes()),
        (
            "runs.tif",
            Stack {
                packing: 32773,
                bits: 8,
                description: IMAGEJ.to_owned(),
                resolution: Some(([3, 2], 1)),
                ..Stack::default()
            }
            .bytes(),
        ),
        ("trained.ply", trained_ply(&[trained(0, 1)], 1, "binary_little_endian")),
        ("words.ply", packed_ply(&[trained(0, 1), trained(1, 1)], 1)),
        ("splats.ply", splats(false)),
        ("packed_splats.ply", splats(true)),
        ("a.sog", sog(&[trained(0, 1), trained(1, 1)], 1)),
        ("whole.ksplat", ksplat(&[trained(0, 1)], 1, 0)),
        ("small.ksplat", ksplat(&[trained(0, 1)], 1, 2)),
        ("a.splat", splat(&[trained(0, 0)])),
        ("old.spz", spz(&[trained(0, 1), trained(1, 1)], 1, 2)),
        ("oldest.spz", spz(&[trained(0, 1)], 1, 1)),
        ("latest.spz", spz_4(&[trained(0, 1), trained(1, 1)], 1)),
        ("gaussians.glb", gaussian_glb(&[trained(0, 1), trained(1, 1)], 1)),
        ("packed.glb", spz_glb(&gzip(&spz(&[trained(0, 1)], 1, 2)), true)),
        ("new.spz", gzip(&spz(&[trained(0, 1), trained(1, 1)], 1, 3))),
    ]
}

/// What ImageJ says of a stack.
const IMAGEJ: &str = "ImageJ=1.54f\nimages=4\nslices=4\nunit=mm\nspacing=2\n";

/// Two splats as files have them.
fn splats(packed: bool) -> Vec<u8> {
    let mut cloud = Cloud::new(DVec3::new(1e6, 0.0, 0.5));
    cloud.push(&Splat { value: 2.0, ..Splat::default() });
    cloud.push(&Splat { kind: SplatKind::Surface, normal: Vec3::Y, tangent: Vec3::X, ..Splat::default() });
    let names = ["it".to_owned()];
    let footprints = FootprintStack::default();
    if packed {
        return splat_core::splat_file::packed_splats_to_ply(&cloud, &names, &[], &footprints).unwrap();
    }
    splat_core::splat_file::splats_to_ply(&cloud, &names, &[], &footprints)
}

/// Files that hold an image, and its bytes.
pub(crate) fn textured() -> Vec<(&'static str, Vec<u8>, Vec<u8>)> {
    let [png, jpeg] = [ImageFormat::Png, ImageFormat::Jpeg];
    vec![("png.glb", square_glb(png), image(4, png)), ("jpeg.glb", square_glb(jpeg), image(4, jpeg))]
}

/// Files of which a part may be a file too.
pub(crate) fn text_samples() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("t.stl", stl(false)),
        ("a.obj", obj()),
        ("a.xyz", text_points(" ", "")),
        ("a.csv", text_points(",", "x,y,z,nx,ny,nz\n")),
        ("text.nrrd", nrrd("text")),
        ("text.mha", metaimage("text", false)),
        ("text.vtk", vtk(false)),
        ("arrays.vtk", vtk(true)),
        ("levels.laz", copc(&[5, 20])),
        ("surface.vtk", vtk_surface(true, false)),
        ("straight.vtk", vtk_structured(true, 0.0)),
    ]
}

/// Files of bodies, which become volumes of many voxels however small they are.
pub(crate) fn bodies() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("ascii.vtu", vtu("ascii", false)),
        ("blocks.vtu", vtu("binary", true)),
        ("pieces.vtu", vtu_pieces("binary", false)),
        ("cells.vtk", vtk_cells(false, false)),
        ("ends.vtk", vtk_cells(true, true)),
        ("bent.vts", vts(0.1)),
        ("faces.vtu", vtu_polyhedra(false)),
        ("faces_of.vtu", vtu_polyhedra(true)),
        ("faces.vtk", vtk_polyhedra(false)),
        ("curved.vtu", vtu_quadratic()),
    ]
}
