#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr, reason = "tests")]

use super::*;
use crate::field;
use crate::gpu::raster::{self, Readback};
use crate::gpu::shader::{self, ShaderVariant};
use crate::gpu::testing::{gpu, validated};
use crate::integral::lookup::tests::{choices, exact, segments, transfer, worst};
use crate::integral::options::{Form, IntegrationOptions};
use crate::transfer::Emission;
use wgpu::naga;

const MAIN: &str = "
@group(1) @binding(0) var<storage, read> cases: array<vec4f>;
@group(1) @binding(1) var<storage, read_write> outcomes: array<vec4f>;
fn most_work() -> u32 { return 1000u; }
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&cases) { return; }
    let c = cases[id.x];
    outcomes[id.x] = looked_up(c.x, c.y, c.z);
}";

fn source(table: &PreintegratedTable, direct: bool) -> String {
    let variant = ShaderVariant { kind: field::Kind::Scalar, direct };
    let constants = constants(Some(table), false) + &declarations(2, 0);
    [&shader::prelude(&variant), &constants, shader::INTEGRAL, TABLE, MAIN].join("\n")
}

/// What the device looks up.
fn looked_up(gpu: &Gpu, table: &PreintegratedTable, direct: bool, segments: &[[f32; 3]]) -> Vec<[f32; 4]> {
    let on_device = OnDevice::holding(gpu, table).unwrap();
    looked_up_in(gpu, (table, &on_device), direct, segments)
}

fn looked_up_in(
    gpu: &Gpu,
    (table, on_device): (&PreintegratedTable, &OnDevice),
    direct: bool,
    segments: &[[f32; 3]],
) -> Vec<[f32; 4]> {
    let own = raster::layout(gpu, wgpu::ShaderStages::COMPUTE, &[Slot::Read, Slot::Write]);
    let tables = raster::layout(gpu, wgpu::ShaderStages::COMPUTE, &SLOTS);
    let module = raster::module(gpu, "test", &source(table, direct));
    let pipeline =
        raster::compute(gpu, &module, "main", &raster::pipeline_layout(gpu, &[None, Some(&own), Some(&tables)]));
    let cases: Vec<[f32; 4]> = segments.iter().map(|&[f, b, l]| [f, b, l, 0.0]).collect();
    let size = 16 * cases.len() as u64;
    let cases = Buffer::holding(gpu, "cases", &cases, Usage::STORAGE).unwrap();
    let outcomes = Buffer::new(gpu, "outcomes", size, Usage::STORAGE | Usage::COPY_SRC).unwrap();
    let own = raster::group(gpu, &own, [&cases, &outcomes].map(|b| b.raw.as_entire_binding()));
    let tables = raster::group(gpu, &tables, on_device.bindings());
    let back = Readback::new(gpu, size).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(1, &own, &[]);
        pass.set_bind_group(2, &tables, &[]);
        pass.dispatch_workgroups((segments.len() as u32).div_ceil(64), 1, 1);
    }
    encoder.copy_buffer_to_buffer(&outcomes.raw, 0, back.raw(), 0, size);
    back.submit(gpu, encoder, |bytes| bytemuck::cast_slice(bytes).to_vec()).unwrap()
}

#[test]
fn layouts_match_their_rust_twins() {
    let table = PreintegratedTable::new(&exact(Emission::Chromatic), &choices()[0], 2.0).unwrap();
    let module = validated(&source(&table, false));
    let (_, t) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some("Table")).unwrap();
    let naga::TypeInner::Struct { span, members } = &t.inner else { panic!("no struct") };
    assert_eq!(*span as usize, size_of::<Parameters>());
    assert_eq!(members.iter().map(|m| m.offset).collect::<Vec<_>>(), [0, 16, 32, 176]);
}

#[test]
fn devices_look_up_as_f64_does() {
    let Some(gpu) = gpu() else { return };
    let segments = segments(20_000);
    for emission in [Emission::Chromatic, Emission::Direct { scale: 0.7 }] {
        for choice in choices() {
            for texels in [Texels::Float, Texels::Unorm16, Texels::Unorm8] {
                if texel_format(&gpu, texels).is_err() || choice.planes == Planes::One {
                    continue;
                }
                let choice = IntegrationOptions { texels, ..choice };
                let table = PreintegratedTable::new(&exact(emission), &choice, 2.0).unwrap();
                let got = looked_up(&gpu, &table, emission != Emission::Chromatic, &segments);
                let worst = worst(&table, &segments, &got);
                // Filters of real devices round their weights to 8 bits; llvmpipe's of 8-bit texels round what they
                // mix, too.
                let bound = match (gpu.adapter.is_software(), texels) {
                    (_, Texels::Unorm8) => 5e-2,
                    (true, _) => 2e-5,
                    (false, _) => 5e-3,
                };
                assert!(worst < bound, "{choice:?}, {emission:?}: {worst}");
            }
        }
    }
}

/// Tables that the device builds are those that it is handed, rows of any length.
#[test]
fn devices_look_up_what_they_built() {
    let Some(gpu) = gpu() else { return };
    let (segments, mut built) = (segments(5000), 0);
    if texel_format(&gpu, Texels::Float).is_err() {
        return;
    }
    for emission in [Emission::Chromatic, Emission::Direct { scale: 0.7 }] {
        let (exact, direct) = (exact(emission), emission != Emission::Chromatic);
        let narrow = Exact::<f32>::new(
            &transfer(emission),
            field::Kind::Scalar,
            &[field::Normalization { mid: 0.0, half: 1.0 }; 4],
            1.0,
        );
        let function = crate::gpu::function::upload(&gpu, &narrow).unwrap();
        let builder = TableBuilder::new(&gpu, direct).unwrap();
        let volumes = [Kind::Uniform, Kind::Log, Kind::LogNormalised].map(|lengths| IntegrationOptions {
            lengths,
            table: Some([17, 17, 8]),
            ..IntegrationOptions::of(Form::Volume)
        });
        for choice in choices().into_iter().filter(|c| c.planes == Planes::Two).chain(volumes) {
            let table = PreintegratedTable::outline(&exact, &choice, 2.0).unwrap();
            let on_device = OnDevice::building(&gpu, &table, &exact, &builder, &function);
            let [front, back, _] = table.size();
            if front != back || choice.degree > 4 {
                assert!(on_device.unwrap_err().to_string().contains("cannot build"), "{choice:?}");
                continue;
            }
            let got = looked_up_in(&gpu, (&table, &on_device.unwrap()), direct, &segments);
            let worst = worst(&PreintegratedTable::new(&exact, &choice, 2.0).unwrap(), &segments, &got);
            let bound = if gpu.adapter.is_software() { 1e-4 } else { 5e-3 };
            assert!(worst < bound, "{choice:?}, {emission:?}: {worst}");
            built += 1;
        }
    }
    assert!(built > 6, "{built}");
}

#[test]
fn one_plane_is_read_as_on_the_host() {
    let Some(gpu) = gpu() else { return };
    let choice = IntegrationOptions {
        planes: Planes::One,
        table: Some([15, 15, 24]),
        ..IntegrationOptions::of(Form::Cylindrical)
    };
    if texel_format(&gpu, choice.texels).is_err() {
        return;
    }
    let table = PreintegratedTable::new(&exact(Emission::Chromatic), &choice, 2.0).unwrap();
    let segments = segments(5000);
    let got = looked_up(&gpu, &table, false, &segments);
    let off = segments.iter().zip(&got).filter(|(s, got)| {
        let want = table.look_up(s[0], s[1], s[2]);
        (0..4).any(|k| (got[k] - want[k]).abs() > 5e-3)
    });
    // Halfway between two planes, rounding decides.
    assert!(off.count() < 25);
}

#[test]
fn tiles_fill_layers() {
    for (most, size, planes, packed) in
        [(16384, 256, 256, false), (1000, 256, 256, false), (1000, 64, 64, true), (64, 64, 8, false), (64, 61, 8, true)]
    {
        let tiles = Tiles::within(most, size, planes, packed);
        let [w, h, layers] = tiles.size();
        assert!(w <= most && h <= most, "{w} x {h}");
        let mut all: Vec<[u32; 3]> = (0..tiles.count).map(|t| tiles.corner(t)).collect();
        for &[x, y, layer] in &all {
            assert!(x + tiles.tile[0] <= w && y + tiles.tile[1] <= h && layer < layers);
        }
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), tiles.count as usize);
    }
    assert_eq!(Tiles::within(16384, 256, 256, false).size(), [4096, 4096, 1]);
    assert_eq!(Tiles::within(256, 256, 256, false).size(), [256, 256, 256]);
}
