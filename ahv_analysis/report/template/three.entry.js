export {
  ArrowHelper, BufferAttribute, BufferGeometry, Color, ConeGeometry, DirectionalLight, DoubleSide, DynamicDrawUsage,
  Euler, Fog, GridHelper, Group, HemisphereLight, Line, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial,
  MeshLambertMaterial, PerspectiveCamera, Quaternion, Scene, Vector2, Vector3, WebGLRenderer,
} from "three";
