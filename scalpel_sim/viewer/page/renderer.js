// What draws the scene: a canvas without holes, whose background is drawn in it.
"use strict";

const { THREE } = MeshCat;

const EXPOSURE = 1.0;
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i; // names of renderers without a card
const LONGEST_DRAWING = 3000; // [ms]: after it the page asks for the next picture in any case
const LONGEST_HIDDEN = 500; // [ms]: a tab that is hidden draws nothing

// Whether a program draws in place of a graphics card. A browser that does not name it counts as one with a card.
function drawsBySoftware() {
    const context = document.createElement("canvas").getContext("webgl2");
    if (context === null) return false;
    const naming = context.getExtension("WEBGL_debug_renderer_info");
    const name = context.getParameter(naming ? naming.UNMASKED_RENDERER_WEBGL : context.RENDERER);
    const losing = context.getExtension("WEBGL_lose_context");
    if (losing) losing.loseContext();
    return SOFTWARE.test(name);
}

// Smooth edges cost software half as much again; a transparent canvas would have each pixel composed twice.
function makeRenderer(pane, isSoftware) {
    const renderer = new THREE.WebGLRenderer({ antialias: !isSoftware, alpha: false });
    renderer.shadowMap.enabled = true;
    renderer.shadowMap.type = THREE.PCFSoftShadowMap;
    renderer.outputEncoding = THREE.sRGBEncoding;
    renderer.toneMapping = THREE.ACESFilmicToneMapping;
    renderer.toneMappingExposure = EXPOSURE;
    pane.append(renderer.domElement);
    return renderer;
}

// The wall behind all: a light that fades from the middle, a little above it, to the corners. It is drawn
// after what is opaque, so that what is hidden costs nothing, and before what is transparent.
function backdrop() {
    const material = new THREE.ShaderMaterial({
        toneMapped: false,
        depthWrite: false,
        vertexShader: `
            varying vec2 place;
            void main() {
                place = vec2(0.5, 0.5) + 0.5 * position.xy;
                gl_Position = vec4(position.xy, 1.0, 1.0);
            }`,
        fragmentShader: `
            varying vec2 place;
            void main() {
                float away = length((place - vec2(0.5, 0.62)) / vec2(0.707, 0.877));
                vec3 near = mix(vec3(0.957, 0.969, 0.969), vec3(0.875, 0.906, 0.910), away / 0.45);
                vec3 far = mix(vec3(0.875, 0.906, 0.910), vec3(0.725, 0.780, 0.792), (away - 0.45) / 0.55);
                gl_FragColor = vec4(away < 0.45 ? near : far, 1.0);
            }`,
    });
    const wall = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), material);
    wall.name = "backdrop";
    wall.frustumCulled = false;
    wall.renderOrder = 1;
    return wall;
}

// Call back once what was changed is drawn, with the time that it took [ms]. A browser queues pictures for the
// graphics: a page that did not wait for them would decode many that are seen late, or never.
function afterDrawing(callback) {
    const since = performance.now();
    let isDone = false;
    const finish = () => {
        if (!isDone) callback(performance.now() - since);
        isDone = true;
    };
    requestAnimationFrame(() => {
        const context = viewer.renderer.getContext();
        const drawn = context.fenceSync && context.fenceSync(context.SYNC_GPU_COMMANDS_COMPLETE, 0);
        context.flush();
        const look = () => {
            if (isDone) return;
            const isDrawn = !drawn || context.clientWaitSync(drawn, 0, 0) !== context.TIMEOUT_EXPIRED;
            if (!isDrawn) return void setTimeout(look);
            if (drawn) context.deleteSync(drawn);
            finish();
        };
        setTimeout(look);
    });
    setTimeout(finish, document.hidden ? LONGEST_HIDDEN : LONGEST_DRAWING);
}
