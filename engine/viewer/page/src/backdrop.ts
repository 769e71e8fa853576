// What is behind the picture: a dark gradient.
import * as THREE from "three";

const kVertex = /* glsl */ `
    varying vec2 vAt;
    void main() {
        vAt = position.xy * 0.5 + 0.5;
        gl_Position = vec4(position.xy, 0.0, 1.0);
    }`;
const kFragment = /* glsl */ `
    varying vec2 vAt;
    void main() {
        float d = length((vAt - vec2(0.45, 0.56)) * vec2(1.1, 1.0));
        vec3 colour = mix(vec3(0.105, 0.140, 0.205), vec3(0.022, 0.031, 0.052), smoothstep(0.0, 0.85, d));
        float dither = fract(sin(dot(gl_FragCoord.xy, vec2(12.9898, 78.233))) * 43758.5453) / 255.0;
        gl_FragColor = vec4(colour + dither, 1.0);
    }`;

export class Backdrop {
    private readonly scene = new THREE.Scene();
    private readonly flat = new THREE.OrthographicCamera(-1, 1, 1, -1, 0, 1);

    constructor() {
        const material = new THREE.ShaderMaterial({ vertexShader: kVertex, fragmentShader: kFragment, depthTest: false, depthWrite: false });
        const quad = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), material);
        quad.frustumCulled = false;
        this.scene.add(quad);
    }
    render(renderer: THREE.WebGLRenderer): void { renderer.render(this.scene, this.flat); }
}
