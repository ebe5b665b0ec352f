/** Numbers in any form that remesh() takes. */
export type Numbers = number[] | number[][] | Float32Array | Float64Array | Int32Array | Uint32Array | Int16Array | Uint16Array | Int8Array | Uint8Array;

/** The options of the library. At most one of faces, vertices, edge_length and ratio. */
export interface Options {
  /** options that suit a kind of surface; those that are given beside it win */
  preset?: /* PRESETS */;
  /** borders that edges of the result follow, of a surface that was loaded from a file: seams, materials, groups, objects or names of attributes */
  keep?: string | string[];
  /** texture coordinates of the result's own, "uv", instead of those of the input */
  unwrap?: boolean;
  /** maps on such coordinates of what the input looks like: "input" (normals, and what its materials, textures and colours have), "all", or any of color, normal, orm, emission, occlusion and height */
  bake?: string | string[] | null;
  /* OPTIONS */
}

export interface Picture {
  width: number;
  height: number;
  channels: number;
  /** 8, or 16 of the height map */
  bits: number;
  /** the upper row first; colours are sRGB */
  pixels: Uint8Array | Uint16Array;
}

export interface Asset {
  /* ASSET */
}

export interface Topology {
  /* TOPOLOGY */
  /** interior vertices by valence, "9" and more together; only those that there are */
  valence: Record<string, number>;
}

export interface Quality {
  /* QUALITY */
}

export interface Report {
  /* REPORT */
  topology: Topology;
  warnings: string[];
  [more: string]: unknown;
}

export type Status = /* STATUSES */ | 'CRASHED';

/** A failure of the library, in a sentence that names its cause. */
export class QuadwrightError extends Error {
  readonly status: Status;
  /** that of the command line tool */
  readonly exitCode: number;
}

export interface Attribute {
  /** count * components numbers; whole ones where the kind is labels */
  values: Numbers;
  components?: number;
  domain?: 'vertex' | 'corner' | 'face';
  kind?: 'values' | 'normals' | 'uvs' | 'weights' | 'labels';
  /** of weights: the group of each */
  groups?: Numbers | null;
  /** of labels, where a file has them */
  names?: string[];
}

export interface CarriedAttribute extends Required<Pick<Attribute, 'components' | 'domain' | 'kind'>> {
  values: Float32Array | Int32Array;
  groups?: Uint32Array;
  names?: string[];
}

export interface Surface {
  positions: Float64Array;
  indices: Uint32Array;
  /** corners of every face where faceSizes is null */
  faceSize: number;
  faceSizes: Uint32Array | null;
  /** the faces only join points that came without any: the option wrap makes a surface of them */
  points: boolean;
}

export interface Result {
  /** three a vertex, in the units of the input */
  positions: Float64Array;
  /** four vertices a quad, counter-clockwise from outside */
  quads: Uint32Array;
  /** polygons of the input that stayed as they are: outside of a region, or one at a boundary that is fixed; null where all are quads */
  rest: { indices: Uint32Array; faceSizes: Uint32Array } | null;
  report: Report;
  /** those of the input, carried over */
  attributes: Record<string, CarriedAttribute>;
  /** figures of the texture coordinates and maps, where the result has its own */
  asset?: Asset;
  /** what was baked, by name; of several tiles "color.1002" and so on */
  maps?: Record<string, Picture>;
}

export interface SurfaceOptions {
  /** corners of every face: 3 (default) or 4 */
  faceSize?: 3 | 4;
  /** corners of each face, for polygons */
  faceSizes?: Numbers | null;
  /** pairs of vertices whose edge is sharp; turns sharp_marks on unless it is given */
  markedEdges?: Numbers | null;
  attributes?: Record<string, Attribute>;
}

/** A polyline on the surface or near it. */
export interface Guide {
  /** three a point */
  points: Numbers;
  /** edges of the result lie on it (loop, the default), or quads run along it (direction) */
  kind?: 'loop' | 'direction';
  closed?: boolean;
  /** of a closed loop, closed rings of quads wanted on each side of it, up to 1000; 0 unless given */
  rings?: number;
}

export interface Steering {
  /** a number for each vertex, 0.001 to 1000: where it is 2 edges are half as long as where it is 1 */
  density?: Numbers | null;
  guides?: Guide[] | null;
  /** 1 for each face that is to be remeshed, 0 for those that stay */
  region?: Numbers | null;
}

export interface Hooks {
  signal?: AbortSignal;
  /** CANCEL, returned or promised, cancels the run; what it throws ends it */
  progress?: (stage: string, fraction: number) => unknown;
  /** warnings of the library */
  log?: (warning: string) => void;
}

export interface RemeshOptions extends Options, SurfaceOptions, Steering, Hooks {
  /** moves the arrays to the Worker instead of copying them: they are empty afterwards */
  transfer?: boolean;
  /** bytes, or a text such as '2G'; 0: none but that of the address space, 4 GiB */
  memoryLimit?: number | string;
}

export interface Tables {
  version: string;
  statuses: { status: string; text: string; exitCode: number }[];
  options: { name: string; kind: 'count' | 'real' | 'flag' | 'choice'; initial: number; least: number; most: number; unit: string; choices: string[] | null; help: string }[];
  /** those of texture coordinates and maps */
  assetOptions: { name: string; kind: 'count' | 'real' | 'flag' | 'choice'; initial: number; least: number; most: number; unit: string; choices: string[] | null; help: string }[];
  presets: { name: string; settings: string; help: string }[];
  fields: Record<'report' | 'topology' | 'quality' | 'asset', { name: string; unit: string; help: string; whole: boolean; optional: boolean }[]>;
}

/** Loads the module, once. wasm: where the package cannot find it by itself. threads: of each Worker; 0 (default): one for each processor, up
 * to eight, on pages that are cross-origin isolated, else 1. Results are the same. */
export function init(options?: { wasm?: BufferSource | WebAssembly.Module | null; threads?: number }): Promise<Tables>;
export function tables(): Tables;

/** What a progress function returns to cancel a run. */
export const CANCEL: 'cancel';

/** Remeshes in a Worker that ends with the call. indices null: every three positions are a triangle. */
export function remesh(positions: Numbers, indices: Numbers | null, options?: RemeshOptions): Promise<Result>;

/** Quads with texture coordinates of their own, and maps: remesh with bake "input". */
export function asset(positions: Numbers, indices: Numbers | null, options?: RemeshOptions): Promise<Result>;

/** The same on the calling thread. progress returns CANCEL to cancel. */
export function remeshSync(
  positions: Numbers,
  indices: Numbers | null,
  options?: Options & SurfaceOptions & Steering & { progress?: (stage: string, fraction: number) => unknown; log?: (warning: string) => void; memoryLimit?: number | string },
): Result;

/** A surface that is remeshed more than once, in a Worker that keeps what two runs have in common. */
export class Remesher {
  constructor(options?: { memoryLimit?: number | string });
  /** a file of OBJ, PLY, OFF, STL, GLB or glTF, or of points: PLY, PCD, XYZ; in Node also its path */
  load(file: ArrayBuffer | Uint8Array | Blob | string | URL, hooks?: Pick<Hooks, 'signal' | 'log'>): Promise<Surface>;
  set(positions: Numbers, indices: Numbers | null, options?: SurfaceOptions & { transfer?: boolean; signal?: AbortSignal }): Promise<void>;
  /** points without faces, three numbers a point, and attributes of theirs: a surface with the option wrap */
  setPoints(positions: Numbers, options?: { attributes?: Record<string, Attribute>; signal?: AbortSignal }): Promise<void>;
  /** signal, progress and log among the options, or in an object of their own */
  remesh(options?: Options & Hooks, hooks?: Hooks): Promise<Result>;
  /** what is missing is taken away */
  steer(steering?: Steering, hooks?: Pick<Hooks, 'signal'>): Promise<void>;
  mark(names: string): Promise<void>;
  save(format: 'obj' | 'ply' | 'off' | 'stl' | 'glb' | 'gltf', options?: { bare?: boolean }): Promise<Uint8Array>;
  measure(options?: { input?: string | null; output?: string | null; signal?: AbortSignal }): Promise<{ report: Report; quality: Quality; [more: string]: unknown }>;
  close(): void;
}

/** Runs a small surface, so that the engine has its better code before the first run that matters, which takes about twice as long else. */
export function warmUp(): Promise<void>;
