// Snow lies above a height, less of it where the ground is steep. Heights and distances are metres, as in the scene.
fn fragment_shader(fragment: Fragment) -> vec3f {
    // The line runs a hundred metres up and down, in no pattern that the eye finds.
    let at = fragment.position.xy / 1000.0;
    let ragged = sin(3.1 * at.x + 2.0 * sin(2.3 * at.y)) + sin(4.7 * at.y + 2.0 * sin(3.7 * at.x));
    let high = smoothstep(-100.0, 100.0, fragment.position.z + 50.0 * ragged - parameters.snow_line);
    let gentle = smoothstep(parameters.steepest - 0.1, parameters.steepest + 0.1, fragment.normal.z);
    return lit(fragment, mix(fragment.color, vec3f(0.9, 0.93, 1.0), high * gentle));
}
