import type { BufferGeometry } from 'three';
import type { Attribute, RemeshOptions, Result } from 'quadwright';

/** The arguments of remesh() for a geometry, with its attributes. Groups become the label "group". */
export function fromGeometry(geometry: BufferGeometry, options?: RemeshOptions): [Float32Array, Uint32Array, RemeshOptions];

/** Each quad as two triangles, with the attributes of the result, and the edges of the quads for LineSegments. */
export function toGeometry(result: Pick<Result, 'positions' | 'quads'> & { attributes?: Record<string, Attribute> }): {
  geometry: BufferGeometry;
  edges: BufferGeometry;
};
