// Dots where contacts are, coloured by depth.
import * as THREE from "three";

const kDeepest = 2e-4;   // m, where the colours of contacts end
const kFewestDots = 256; // capacity of the buffers at first

export function makeDots(): THREE.Points {
    const material = new THREE.ShaderMaterial({
        transparent: true, depthTest: false, depthWrite: false, uniforms: { deepest: { value: kDeepest }, ratio: { value: 1 } },
        vertexShader: /* glsl */ `
            attribute float depth;
            uniform float deepest;
            uniform float ratio;
            varying float vDepth;
            void main() {
                vDepth = clamp(depth / deepest, 0.0, 1.0);
                gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
                gl_PointSize = (8.0 + 5.0 * vDepth) * ratio;
            }`,
        fragmentShader: /* glsl */ `
            varying float vDepth;
            void main() {
                float r = length(gl_PointCoord - 0.5);
                if (r > 0.5) discard;
                vec3 colour = vDepth < 0.5 ? mix(vec3(0.99, 0.91, 0.42), vec3(0.98, 0.52, 0.16), 2.0 * vDepth)
                                           : mix(vec3(0.98, 0.52, 0.16), vec3(0.84, 0.05, 0.35), 2.0 * vDepth - 1.0);
                gl_FragColor = vec4(mix(vec3(0.04), colour, smoothstep(0.5, 0.38, r)), 1.0);
            }`,
    });
    const dots = new THREE.Points(new THREE.BufferGeometry(), material);
    setDots(dots.geometry, new Float32Array(0));
    dots.renderOrder = 70;
    dots.frustumCulled = false;
    return dots;
}

/// x, y, z, depth of each. The buffers on the card stay; only where more dots come than ever before larger ones take their place.
export function setDots(geometry: THREE.BufferGeometry, dots: Float32Array): void {
    let buffer = (geometry.getAttribute("position") as THREE.InterleavedBufferAttribute | undefined)?.data;
    if (buffer === undefined || buffer.array.length < dots.length) {
        geometry.dispose();
        buffer = new THREE.InterleavedBuffer(new Float32Array(Math.max(kFewestDots * 4, 2 * dots.length)), 4).setUsage(THREE.DynamicDrawUsage);
        geometry.setAttribute("position", new THREE.InterleavedBufferAttribute(buffer, 3, 0));
        geometry.setAttribute("depth", new THREE.InterleavedBufferAttribute(buffer, 1, 3));
    }
    (buffer.array as Float32Array).set(dots);
    buffer.clearUpdateRanges();
    buffer.addUpdateRange(0, dots.length);
    buffer.needsUpdate = true;
    geometry.setDrawRange(0, dots.length / 4);
}
