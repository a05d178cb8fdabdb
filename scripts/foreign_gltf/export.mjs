// Writes glTF files with exporters from npm into the folder named: three.js, glTF Transform, Babylon.js, obj2gltf, glTF pipeline, Assimp.
// Run by `run`, from a folder in which they are installed.
import fs from 'node:fs';
import path from 'node:path';
import zlib from 'node:zlib';
import { createRequire } from 'node:module';

const folder = process.argv[2];
const require = createRequire(import.meta.url);
const out = (name) => path.join(folder, name);

/// A PNG of 8-bit RGB.
function png(width, height, pixel) {
    const rows = Buffer.alloc(height * (1 + 3 * width));
    for (let y = 0; y < height; y++) {
        for (let x = 0; x < width; x++) rows.set(pixel(x, y), y * (1 + 3 * width) + 1 + 3 * x);
    }
    const chunk = (type, data) => {
        const body = Buffer.concat([Buffer.from(type), data]);
        const ends = Buffer.alloc(8);
        ends.writeUInt32BE(data.length, 0);
        ends.writeUInt32BE(zlib.crc32(body), 4);
        return Buffer.concat([ends.subarray(0, 4), body, ends.subarray(4)]);
    };
    const head = Buffer.alloc(13);
    head.writeUInt32BE(width, 0);
    head.writeUInt32BE(height, 4);
    head.set([8, 2, 0, 0, 0], 8);
    const signature = Buffer.from([0x89, 0x50, 0x4e, 0x47, 13, 10, 26, 10]);
    return Buffer.concat([signature, chunk('IHDR', head), chunk('IDAT', zlib.deflateSync(rows)), chunk('IEND', Buffer.alloc(0))]);
}

/// Letters, so that a picture shows whether the image lies the right way round: an F, dark on light.
const F = ['........', '.#####..', '.#......', '.####...', '.#......', '.#......', '.#......', '........'];
const letter = png(8, 8, (x, y) => (F[y][x] === '#' ? [60, 30, 20] : [230, 180 - 10 * y, 60 + 20 * x]));
const rough = png(4, 4, (x, y) => [0, 60 + 60 * x, y < 2 ? 0 : 255]);

async function three() {
    globalThis.FileReader = class {
        readAsArrayBuffer(blob) {
            blob.arrayBuffer().then((result) => { this.result = result; this.onloadend(); });
        }
    };
    const THREE = await import('three');
    const { GLTFExporter } = await import('three/addons/exporters/GLTFExporter.js');
    const scene = new THREE.Scene();
    const floor = new THREE.PlaneGeometry(3, 3, 8, 8).rotateX(-Math.PI / 2);
    const colours = [];
    for (let i = 0; i < floor.attributes.position.count; i++) colours.push((i % 9) / 9, 0.5, 1 - Math.floor(i / 9) / 9);
    floor.setAttribute('color', new THREE.Float32BufferAttribute(colours, 3));
    scene.add(new THREE.Mesh(floor, new THREE.MeshStandardMaterial({ vertexColors: true, roughness: 1, name: 'vertex colours' })));
    const glaze = new THREE.MeshPhysicalMaterial({ color: 0x884422, roughness: 0.3, ior: 1.8, specularIntensity: 0.8, specularColor: 0x88ccff, name: 'glaze' });
    const knot = new THREE.Mesh(new THREE.TorusKnotGeometry(0.35, 0.12, 64, 12), glaze);
    knot.position.y = 0.6;
    scene.add(knot);
    const posts = new THREE.InstancedMesh(new THREE.CylinderGeometry(0.06, 0.06, 0.5, 12), new THREE.MeshStandardMaterial({ color: 0xdddddd, metalness: 1, roughness: 0.5 }), 8);
    for (let i = 0; i < 8; i++) {
        posts.setMatrixAt(i, new THREE.Matrix4().makeTranslation(1.2 * Math.cos(i * Math.PI / 4), 0.25, 1.2 * Math.sin(i * Math.PI / 4)));
    }
    scene.add(posts);
    const spot = new THREE.SpotLight(0xffffff, 200, 0, 0.6, 0.3, 2);
    spot.position.set(1, 3, 1);
    spot.target.position.set(0, -1, 0);
    spot.add(spot.target);
    scene.add(spot);
    const glb = await new GLTFExporter().parseAsync(scene, { binary: true });
    fs.writeFileSync(out('three.glb'), Buffer.from(glb));
}

async function transform() {
    const { Document, NodeIO } = await import('@gltf-transform/core');
    const { ALL_EXTENSIONS, KHRTextureTransform, KHRMaterialsEmissiveStrength, KHRMaterialsIOR, KHRMaterialsSpecular } = await import('@gltf-transform/extensions');
    const { instance, quantize, flatten, dedup } = await import('@gltf-transform/functions');
    const io = new NodeIO().registerExtensions(ALL_EXTENSIONS);
    const build = () => {
        const document = new Document();
        const buffer = document.createBuffer();
        const accessor = (type, array) => document.createAccessor().setType(type).setArray(array).setBuffer(buffer);
        const quad = document.createPrimitive()
            .setAttribute('POSITION', accessor('VEC3', new Float32Array([-0.5, 0, 0.5, 0.5, 0, 0.5, 0.5, 0, -0.5, -0.5, 0, -0.5])))
            .setAttribute('TEXCOORD_0', accessor('VEC2', new Float32Array([0, 1, 1, 1, 1, 0, 0, 0])))
            .setAttribute('TEXCOORD_1', accessor('VEC2', new Float32Array([0, 2, 2, 2, 2, 0, 0, 0])))
            .setIndices(accessor('SCALAR', new Uint16Array([0, 1, 2, 0, 2, 3])));
        const image = document.createTexture('letter').setImage(letter).setMimeType('image/png');
        const data = document.createTexture('rough').setImage(rough).setMimeType('image/png');
        const tiles = document.createMaterial('tiles').setBaseColorTexture(image).setMetallicFactor(0).setRoughnessFactor(1);
        const turned = document.createExtension(KHRTextureTransform).createTransform().setScale([3, 3]).setRotation(Math.PI / 6).setTexCoord(1);
        tiles.getBaseColorTextureInfo().setMagFilter(9728).setExtension('KHR_texture_transform', turned);
        const steel = document.createMaterial('steel').setBaseColorFactor([0.8, 0.7, 0.5, 1]).setMetallicRoughnessTexture(data).setDoubleSided(true);
        const lamp = document.createMaterial('lamp').setBaseColorFactor([0, 0, 0, 1]).setEmissiveTexture(image).setEmissiveFactor([1, 1, 1]).setDoubleSided(true)
            .setExtension('KHR_materials_emissive_strength', document.createExtension(KHRMaterialsEmissiveStrength).createEmissiveStrength().setEmissiveStrength(300));
        const varnish = document.createMaterial('varnish').setBaseColorTexture(image).setMetallicFactor(0).setRoughnessFactor(0.3)
            .setExtension('KHR_materials_ior', document.createExtension(KHRMaterialsIOR).createIOR().setIOR(2))
            .setExtension('KHR_materials_specular', document.createExtension(KHRMaterialsSpecular).createSpecular().setSpecularColorFactor([1, 0.6, 0.3]));
        const mesh = (material) => document.createMesh(material.getName()).addPrimitive(quad.clone().setMaterial(material));
        const scene = document.createScene();
        const add = (m, translation, scale = [1, 1, 1], rotation = [0, 0, 0, 1]) =>
            scene.addChild(document.createNode().setMesh(m).setTranslation(translation).setScale(scale).setRotation(rotation));
        const up = [Math.SQRT1_2, 0, 0, Math.SQRT1_2];
        add(mesh(tiles), [0, 0, 0], [3, 1, 3]);
        add(mesh(lamp), [-0.7, 0.6, -0.4], [0.8, 1, 0.8], up);
        add(mesh(varnish), [0.4, 0.5, -0.8], [0.9, 1, 0.9], up);
        const plates = mesh(steel);
        for (let i = 0; i < 6; i++) add(plates, [-1 + 0.4 * i, 0.15, 0.8], [0.3, 1, 0.3], [0, Math.sin(i / 4), 0, Math.cos(i / 4)]);
        return document;
    };
    await io.write(out('gltf_transform.glb'), build());
    const packed = build();
    await packed.transform(dedup(), flatten(), instance({ min: 3 }), quantize());
    await io.write(out('gltf_transform_packed.glb'), packed);
    await io.write(out('gltf_transform_separate.gltf'), build());
    const unlit = build();
    unlit.getRoot().listMaterials()[0].setAlphaMode('BLEND').setNormalTexture(unlit.getRoot().listTextures()[0]);
    await io.write(out('gltf_transform_odd.glb'), unlit);
}

async function babylon() {
    globalThis.XMLHttpRequest ??= class {};
    const B = await import('@babylonjs/core');
    const { GLTF2Export } = await import('@babylonjs/serializers');
    const engine = new B.NullEngine();
    const scene = new B.Scene(engine);
    const material = (name, colour, metallic, roughness) => {
        const m = new B.PBRMaterial(name, scene);
        m.albedoColor = B.Color3.FromArray(colour);
        m.metallic = metallic;
        m.roughness = roughness;
        return m;
    };
    B.MeshBuilder.CreateGround('floor', { width: 3, height: 3 }, scene).material = material('clay', [0.5, 0.3, 0.2], 0, 1);
    const ball = B.MeshBuilder.CreateSphere('ball', { diameter: 0.8, segments: 16 }, scene);
    ball.position.y = 0.4;
    ball.material = material('gold', [1, 0.7, 0.2], 1, 0.35);
    const box = B.MeshBuilder.CreateBox('box', { size: 0.5 }, scene);
    box.position.set(-0.8, 0.25, 0.3);
    box.rotation.y = 0.5;
    box.material = material('plastic', [0.1, 0.4, 0.7], 0, 0.2);
    new B.PointLight('lamp', new B.Vector3(1, 2.5, 1), scene).intensity = 300;
    const data = await GLTF2Export.GLBAsync(scene, 'babylon', { exportUnusedUVs: true });
    const file = data.files ?? data.glTFFiles;
    fs.writeFileSync(out('babylon.glb'), Buffer.from(await file['babylon.glb'].arrayBuffer()));
}

/// A box on a floor as OBJ with a texture.
const OBJ = `mtllib scene.mtl
v -1.5 0 1.5\nv 1.5 0 1.5\nv 1.5 0 -1.5\nv -1.5 0 -1.5
v -0.4 0 0.4\nv 0.4 0 0.4\nv 0.4 0 -0.4\nv -0.4 0 -0.4
v -0.4 0.8 0.4\nv 0.4 0.8 0.4\nv 0.4 0.8 -0.4\nv -0.4 0.8 -0.4
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1
usemtl floor\nf 1/1 2/2 3/3 4/4
usemtl crate\nf 5/1 6/2 10/3 9/4\nf 6/1 7/2 11/3 10/4\nf 7/1 8/2 12/3 11/4\nf 8/1 5/2 9/3 12/4\nf 9/1 10/2 11/3 12/4
`;
const MTL = 'newmtl floor\nKd 0.6 0.6 0.55\nnewmtl crate\nKd 1 1 1\nmap_Kd letter.png\n';

async function obj() {
    const files = { 'scene.obj': OBJ, 'scene.mtl': MTL, 'letter.png': letter };
    for (const [name, content] of Object.entries(files)) fs.writeFileSync(out(name), content);
    const glb = await require('obj2gltf')(out('scene.obj'), { binary: true, metallicRoughness: true });
    fs.writeFileSync(out('obj2gltf.glb'), glb);
    const pipeline = require('gltf-pipeline');
    const gltf = (await pipeline.glbToGltf(glb)).gltf;
    fs.writeFileSync(out('gltf_pipeline.gltf'), JSON.stringify(gltf));
    const draco = await pipeline.processGlb(glb, { dracoOptions: { compressionLevel: 7 } });
    fs.writeFileSync(out('draco.glb'), draco.glb);
    const assimp = await require('assimpjs')();
    const list = new assimp.FileList();
    for (const [name, content] of Object.entries(files)) list.AddFile(name, new Uint8Array(Buffer.from(content)));
    const result = assimp.ConvertFileList(list, 'glb2');
    if (!result.IsSuccess()) throw new Error(result.GetErrorCode());
    fs.writeFileSync(out('assimp.glb'), result.GetFile(0).GetContent());
}

for (const [name, write] of Object.entries({ three, transform, babylon, obj })) {
    try {
        await write();
    } catch (error) {
        console.error(`${name}: ${error.stack}`);
        process.exitCode = 1;
    }
}
