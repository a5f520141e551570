// dynaskin in React: a component of react-three-fiber.
import { Canvas } from "@react-three/fiber";
import { StrictMode, Suspense } from "react";
import { createRoot } from "react-dom/client";
import { showError } from "../src/shared/note.js";
import { SoftBody } from "./SoftBody.js";

function App() {
  return (
    <Canvas
      shadows
      style={{ height: "100vh" }}
      camera={{ position: [1.6, 1.5, 4.6], fov: 24 }}
      onCreated={({ camera }) => camera.lookAt(0, 1, 0)}
    >
      <color attach="background" args={["#e9e6e1"]} />
      <hemisphereLight args={["#ffffff", "#b0a090", 1.5]} />
      <directionalLight position={[-1.5, 3, 2.5]} intensity={2.5} castShadow />
      <mesh rotation-x={-Math.PI / 2} receiveShadow>
        <circleGeometry args={[3, 64]} />
        <meshStandardMaterial color="#cfcac2" />
      </mesh>
      <Suspense fallback={null}>
        <SoftBody model={new URL("../female/", location.href).href} motion="shake-hips" />
      </Suspense>
    </Canvas>
  );
}

const root = document.getElementById("root");
if (root) {
  createRoot(root, { onUncaughtError: showError }).render(
    <StrictMode>
      <App />
    </StrictMode>,
  );
}
