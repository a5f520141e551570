// three-vrm's MToonNodeMaterial 3.5.5 imports a node by the name that it had before three 0.187.
export * from "/node_modules/three/build/three.tsl.js";
export { normalView as transformedNormalView } from "/node_modules/three/build/three.tsl.js";
