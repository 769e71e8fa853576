// The X-ray picture: attenuation adds up along each ray, back faces minus front faces, and becomes grey at the end.
import * as THREE from "three";

const kResolveVertex = /* glsl */ `
    varying vec2 vAt;
    void main() {
        vAt = position.xy * 0.5 + 0.5;
        gl_Position = vec4(position.xy, 0.0, 1.0);
    }`;
const kResolveFragment = /* glsl */ `
    uniform sampler2D thickness;
    uniform float time;
    varying vec2 vAt;
    float grain(vec2 p) { return fract(sin(dot(p, vec2(12.9898, 78.233)) + time) * 43758.5453); }
    void main() {
        float path = max(texture2D(thickness, vAt).r, 0.0);
        float light = exp(-path);
        vec2 c = vAt - 0.5;
        float field = smoothstep(0.95, 0.2, length(c));
        float grey = light * (0.58 + 0.30 * field) + 0.022 * (grain(gl_FragCoord.xy) - 0.5);
        gl_FragColor = vec4(vec3(grey) * vec3(0.96, 0.985, 1.0), 1.0);
    }`;
const kBackdropFragment = /* glsl */ `
    varying vec2 vAt;
    void main() {
        float d = length((vAt - vec2(0.45, 0.56)) * vec2(1.1, 1.0));
        vec3 colour = mix(vec3(0.105, 0.140, 0.205), vec3(0.022, 0.031, 0.052), smoothstep(0.0, 0.85, d));
        float dither = fract(sin(dot(gl_FragCoord.xy, vec2(12.9898, 78.233))) * 43758.5453) / 255.0;
        gl_FragColor = vec4(colour + dither, 1.0);
    }`;

export class Fluoroscope {
    readonly scene = new THREE.Scene();
    private target: THREE.WebGLRenderTarget | undefined;
    private width = 1;
    private height = 1;
    private readonly screen = new THREE.Scene();
    private readonly backdrop = new THREE.Scene();
    private readonly flat = new THREE.OrthographicCamera(-1, 1, 1, -1, 0, 1);
    private readonly resolve: THREE.ShaderMaterial;

    constructor() {
        this.resolve = new THREE.ShaderMaterial({
            vertexShader: kResolveVertex, fragmentShader: kResolveFragment, depthTest: false, depthWrite: false,
            uniforms: { thickness: { value: null }, time: { value: 0 } },
        });
        const back = new THREE.ShaderMaterial({ vertexShader: kResolveVertex, fragmentShader: kBackdropFragment, depthTest: false, depthWrite: false });
        const plane = new THREE.PlaneGeometry(2, 2);
        for (const [scene, material] of [[this.screen, this.resolve], [this.backdrop, back]] as const) {
            const quad = new THREE.Mesh(plane, material);
            quad.frustumCulled = false;
            scene.add(quad);
        }
    }

    resize(width: number, height: number): void {
        this.width = Math.max(1, width);
        this.height = Math.max(1, height);
        this.target?.dispose();
        this.target = undefined;
    }

    renderBackdrop(renderer: THREE.WebGLRenderer): void { renderer.render(this.backdrop, this.flat); }

    render(renderer: THREE.WebGLRenderer, camera: THREE.Camera): void {
        if (this.target === undefined) {
            const gl = renderer.getContext();
            const whole = gl.getExtension("EXT_color_buffer_float") !== null && gl.getExtension("EXT_float_blend") !== null;
            this.target = new THREE.WebGLRenderTarget(this.width, this.height, {
                type: whole ? THREE.FloatType : THREE.HalfFloatType, format: THREE.RGBAFormat, depthBuffer: false,
                minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter,
            });
        }
        renderer.setRenderTarget(this.target);
        renderer.setClearColor(0x000000, 0);
        renderer.clear();
        renderer.render(this.scene, camera);
        renderer.setRenderTarget(null);
        this.resolve.uniforms.thickness.value = this.target.texture;
        this.resolve.uniforms.time.value = (performance.now() % 997) * 0.01;
        renderer.render(this.screen, this.flat);
    }
}
