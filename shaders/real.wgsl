// Functions that are as accurate as f32 can tell on every device.

/// eˣ for x ≤ 0, as src/real.rs has it, but not below e^−87: the built-in function may be off by more.
fn exponential(x: f32) -> f32 {
    let clamped = max(x, -87.0);
    let k = round(clamped * 1.442695);
    let r = fma(k, 2.1219444e-4, fma(k, -0.693359375, clamped));
    let p = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0))))));
    return p * bitcast<f32>(u32(i32(k) + 127) << 23u);
}

/// 1 − e^{−depth}, accurate relative to itself.
fn opacity_of_depth(d: f32) -> f32 {
    if d < 0.25 {
        return d * (1.0 - d / 2.0 * (1.0 - d / 3.0 * (1.0 - d / 4.0 * (1.0 - d / 5.0 * (1.0 - d / 6.0)))));
    }
    return 1.0 - exponential(-d);
}
