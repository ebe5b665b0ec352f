/* GLB in and out by three.js, loaded only when a GLB is wanted. */

/* The triangles of all meshes of a GLB, in its own coordinates: {positions, indices}. */
export async function readGlb(buffer) {
  const { GLTFLoader } = await import('three/addons/loaders/GLTFLoader.js');
  const { scene } = await new GLTFLoader().parseAsync(buffer, '');
  const positions = [], indices = [];
  scene.updateMatrixWorld(true);
  scene.traverse((object) => {
    if (!object.isMesh) return;
    const { position } = object.geometry.attributes, { index } = object.geometry, base = positions.length / 3;
    const point = object.position.clone();
    for (let v = 0; v < position.count; v++) positions.push(...point.fromBufferAttribute(position, v).applyMatrix4(object.matrixWorld));
    const turned = object.matrixWorld.determinant() < 0, count = index ? index.count : position.count;
    for (let i = 0; i + 2 < count; i += 3) {
      const [a, b, c] = [i, i + 1, i + 2].map((k) => base + (index ? index.getX(k) : k));
      indices.push(a, ...(turned ? [c, b] : [b, c]));
    }
  });
  return { positions: Float64Array.from(positions), indices: Uint32Array.from(indices), faceSize: 3, faceSizes: null };
}

/* GLB knows no quads: each is two triangles of one geometry, with its edges as lines beside it. */
export async function writeGlb(result) {
  const [{ GLTFExporter }, { Group, LineBasicMaterial, LineSegments, Mesh, MeshStandardMaterial }, { toGeometry }] = await Promise.all([
    import('three/addons/exporters/GLTFExporter.js'), import('three'), import('quadwright/three'),
  ]);
  const { geometry, edges } = toGeometry(result), group = new Group();
  const mesh = new Mesh(geometry, new MeshStandardMaterial()), lines = new LineSegments(edges, new LineBasicMaterial({ color: 0 }));
  mesh.name = 'quads as triangles', lines.name = 'edges of the quads';
  group.add(mesh, lines);
  return new Uint8Array(await new GLTFExporter().parseAsync(group, { binary: true }));
}
