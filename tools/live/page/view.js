// What is drawn: particles as shaded discs, containers, floor, domain; turning, moving, zooming; a cup that is dragged.
"use strict";

const GRADIENTS = {
  // Dark to bright, readable without color vision.
  speed: ["#2a186c", "#14439c", "#206e8b", "#3c9387", "#5ab978", "#aad85c", "#fdef9a"],
  density: ["#2166ac", "#67a9cf", "#d1e5f0", "#f7f7f7", "#fddbc7", "#ef8a62", "#b2182b"],
  pressure: ["#0d0887", "#5c01a6", "#9c179e", "#cc4778", "#ed7953", "#fdb42f", "#f0f921"],
  // Red is beyond tolerance.
  score: ["#1b3a4b", "#26535c", "#2f6f73", "#46907a", "#5fa777", "#8fb968", "#b8c95a", "#e8d44d", "#ff0033"],
};
const REGION_COLORS = ["#5b9bff", "#ffffff", "#5fd38d", "#f2a93b", "#ff4d4d"];

/** Bytes of one picture (tools/live/picture.hpp) as arrays; nothing is copied. */
function readPicture(buffer) {
  const head = new Float64Array(buffer, 0, 14);
  const [version, n, containers, substep, time, quantity, least, largest] = head;
  if (version !== 1) throw new Error(`pictures of version ${version}; this page is of another decant`);
  const first = 14 + 12 * containers;
  return {
    n, substep, time, least, largest, quantity,
    min: head.slice(8, 11), extent: head.slice(11, 14),
    poses: new Float64Array(buffer, 8 * 14, 12 * containers),
    particles: new Uint16Array(buffer, 8 * first, 4 * n),
  };
}

class View {
  constructor(canvas, onDragCup) {
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    this.renderer.setClearColor(0x12161c);
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(35, 1, 0.001, 100);
    this.camera.up.set(0, 0, 1);
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => { this.dirty = true; });
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x445566, 1));
    this.still = new THREE.Group();  // floor and domain
    this.scene.add(this.still);
    this.containers = [];
    this.palettes = Object.fromEntries(Object.entries(GRADIENTS).map(([name, colors]) => [name, palette(colors, true)]));
    this.palettes.region = palette(REGION_COLORS, false);
    this.palettes.unknown = palette(["#808a96"], false);
    this.material = new THREE.RawShaderMaterial({
      uniforms: {
        least: { value: new THREE.Vector3() }, extent: { value: new THREE.Vector3() },
        diameter: { value: 0.001 }, pixels: { value: 1 }, colors: { value: this.palettes.speed },
      },
      vertexShader: `
        precision highp float;
        attribute vec3 position; attribute float value;
        uniform mat4 modelViewMatrix, projectionMatrix;
        uniform vec3 least, extent; uniform float diameter, pixels;
        varying float along;
        void main() {
          vec4 eye = modelViewMatrix * vec4(least + extent * position, 1.0);
          gl_Position = projectionMatrix * eye;
          gl_PointSize = max(1.5, 0.5 * diameter * pixels * projectionMatrix[1][1] / -eye.z);
          along = value;
        }`,
      fragmentShader: `
        precision mediump float;
        uniform sampler2D colors; varying float along;
        void main() {
          vec2 p = 2.0 * gl_PointCoord - 1.0;
          float r = dot(p, p);
          if (r > 1.0) discard;
          float lit = dot(vec3(p.x, -p.y, sqrt(1.0 - r)), normalize(vec3(-0.3, 0.5, 0.8)));
          gl_FragColor = vec4(texture2D(colors, vec2(along, 0.5)).rgb * (0.45 + 0.55 * max(lit, 0.0)), 1.0);
        }`,
    });
    this.points = null;
    this.dirty = true;
    this.dragging(onDragCup);
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / Math.max(height, 1);
    this.camera.updateProjectionMatrix();
    this.material.uniforms.pixels.value = height * this.renderer.getPixelRatio();
    this.dirty = true;
  }

  /** Containers, floor and domain of another scene; the camera stays where the scene's room is the same. */
  setScene(scene) {
    for (const group of this.containers) {
      this.scene.remove(group);
      for (const one of group.children) {
        one.geometry.dispose();
        one.material.dispose();
      }
    }
    this.containers = scene.containers.map((container) => {
      const group = new THREE.Group();
      group.matrixAutoUpdate = false;
      const solids = container.profile ? [revolved(container.profile)] : container.boxes.map(box);
      for (const solid of solids) {
        const mesh = new THREE.Mesh(solid, new THREE.MeshLambertMaterial({
          color: container.tilts ? 0x9fc5ff : 0xbfc8d4, transparent: true, opacity: 0.16, side: THREE.DoubleSide, depthWrite: false,
        }));
        mesh.userData = container;
        group.add(mesh);
        group.add(new THREE.LineSegments(new THREE.EdgesGeometry(solid, 30),
          new THREE.LineBasicMaterial({ color: 0x7f8ea3, transparent: true, opacity: 0.5 })));
      }
      this.scene.add(group);
      return group;
    });
    const min = new THREE.Vector3(...scene.min), max = new THREE.Vector3(...scene.max);
    const room = [...scene.min, ...scene.max].join();
    this.material.uniforms.diameter.value = scene.spacing;
    this.dirty = true;
    if (room === this.room) return;
    this.room = room;
    while (this.still.children.length) this.still.remove(this.still.children[0]);
    const domain = new THREE.Box3Helper(new THREE.Box3(min, max), 0x36404e);
    this.still.add(domain);
    const size = max.clone().sub(min);
    if (scene.floor !== null) {
      const grid = new THREE.GridHelper(Math.max(size.x, size.y), 20, 0x36404e, 0x252d38);
      grid.rotation.x = Math.PI / 2;
      grid.position.set((min.x + max.x) / 2, (min.y + max.y) / 2, scene.floor);
      this.still.add(grid);
    }
    this.aim = true;  // at the first picture, which says where the containers are
    this.camera.near = size.length() / 1000;
    this.camera.far = size.length() * 20;
    this.camera.updateProjectionMatrix();
  }

  /** Looks at all containers and particles from the front, a little from above. */
  lookAtAll(picture) {
    const all = new THREE.Box3();
    for (const group of this.containers) all.expandByObject(group);
    const p = picture.particles, stride = 4 * Math.max(1, Math.floor(picture.n / 1000));
    for (let k = 0; k < p.length; k += stride)
      all.expandByPoint(new THREE.Vector3(...[0, 1, 2].map((a) => picture.min[a] + picture.extent[a] * p[k + a] / 65535)));
    if (all.isEmpty()) return;
    const center = all.getCenter(new THREE.Vector3()), radius = all.getSize(new THREE.Vector3()).length() / 2;
    this.controls.target.copy(center);
    const half = THREE.Math.degToRad(this.camera.fov / 2), away = 0.95 * radius / Math.sin(half) / Math.min(1, this.camera.aspect);
    this.camera.position.set(center.x, center.y - 0.96 * away, center.z + 0.28 * away);
    this.controls.update();
  }

  show(picture, quantity) {
    if (!this.points || this.points.userData.n !== picture.n) {
      if (this.points) {
        this.scene.remove(this.points);
        this.points.geometry.dispose();
      }
      this.buffer = new THREE.InterleavedBuffer(picture.particles, 4).setUsage(THREE.DynamicDrawUsage);
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.InterleavedBufferAttribute(this.buffer, 3, 0, true));
      geometry.setAttribute("value", new THREE.InterleavedBufferAttribute(this.buffer, 1, 3, true));
      this.points = new THREE.Points(geometry, this.material);
      this.points.frustumCulled = false;
      this.points.userData.n = picture.n;
      this.scene.add(this.points);
    }
    this.buffer.array = picture.particles;
    this.buffer.needsUpdate = true;
    this.material.uniforms.least.value.set(...picture.min);
    this.material.uniforms.extent.value.set(...picture.extent);
    this.material.uniforms.colors.value = this.palettes[quantity];
    this.containers.forEach((group, k) => {
      const m = picture.poses.subarray(12 * k, 12 * k + 12);
      group.matrix.set(m[0], m[1], m[2], m[9], m[3], m[4], m[5], m[10], m[6], m[7], m[8], m[11], 0, 0, 0, 1);
      group.matrixWorldNeedsUpdate = true;
    });
    if (this.aim) {
      this.scene.updateMatrixWorld(true);
      this.lookAtAll(picture);
      this.aim = false;
    }
    this.dirty = true;
  }

  draw() {
    if (!this.dirty) return;
    this.dirty = false;
    this.renderer.render(this.scene, this.camera);
  }

  /** A cup is turned by dragging it sideways; beside cups the drag turns the view. */
  dragging(onDragCup) {
    const ray = new THREE.Raycaster();
    const cupAt = (event) => {
      const r = this.canvas.getBoundingClientRect();
      ray.setFromCamera(new THREE.Vector2(2 * (event.clientX - r.left) / r.width - 1, 1 - 2 * (event.clientY - r.top) / r.height), this.camera);
      const meshes = this.containers.flatMap((group) => group.children.filter((one) => one.isMesh && one.userData.tilts));
      const [hit] = ray.intersectObjects(meshes);
      return hit && hit.object.userData;
    };
    let held = null, pressed = 0, moved = false;
    this.canvas.addEventListener("pointermove", (event) => {
      if (!held) {
        if (!event.buttons) this.canvas.style.cursor = cupAt(event) ? "ew-resize" : "";
        return;
      }
      onDragCup(held, 0.5 * (event.clientX - pressed), !moved);
      moved = true;
    });
    this.canvas.addEventListener("pointerdown", (event) => {
      held = event.button === 0 && !event.shiftKey ? cupAt(event) : null;
      pressed = event.clientX;
      moved = false;
      this.controls.enabled = !held;
      if (held) this.canvas.setPointerCapture(event.pointerId);
    }, true);
    for (const end of ["pointerup", "pointercancel"])
      this.canvas.addEventListener(end, () => { held = null; this.controls.enabled = true; });
  }
}

function palette(colors, smooth) {
  const bytes = new Uint8Array(colors.flatMap((c) => [1, 3, 5].map((k) => parseInt(c.slice(k, k + 2), 16)).concat(255)));
  const texture = new THREE.DataTexture(bytes, colors.length, 1, THREE.RGBAFormat);
  texture.magFilter = texture.minFilter = smooth ? THREE.LinearFilter : THREE.NearestFilter;
  texture.needsUpdate = true;
  return texture;
}

function revolved(profile) {
  const points = [...profile, profile[0]].map(([r, z]) => new THREE.Vector2(r, z));
  const geometry = new THREE.LatheBufferGeometry(points, 48);
  geometry.rotateX(Math.PI / 2);  // three.js turns about y
  return geometry;
}

function box([min, max]) {
  const geometry = new THREE.BoxBufferGeometry(max[0] - min[0], max[1] - min[1], max[2] - min[2]);
  geometry.translate((min[0] + max[0]) / 2, (min[1] + max[1]) / 2, (min[2] + max[2]) / 2);
  return geometry;
}
