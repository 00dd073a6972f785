/** The pages by their routes. */
import type { VNode } from "preact";

import { SurgeriesPage } from "../surgeries/surgeries-page";
import { SurgeryPage } from "../surgeries/surgery-page";
import { lazy } from "./lazy";
import { href, paths, route } from "./route";

const StageImagesPage = lazy(() => import("../images").then((area) => area.StageImagesPage));
const CalibrationsPage = lazy(() => import("../calibration").then((area) => area.CalibrationsPage));
const CalibrationPage = lazy(() => import("../calibration").then((area) => area.CalibrationPage));
const RadiographsPage = lazy(() => import("../radiographs").then((area) => area.RadiographsPage));
const SetupPage = lazy(() => import("../setup").then((area) => area.SetupPage));
const PlannerPage = lazy(() => import("../planner").then((area) => area.PlannerPage));

/** The page that the address names. */
export function Page(): VNode {
  const wanted = route.value;
  switch (wanted.page) {
    case "surgeries":
      return <SurgeriesPage />;
    case "surgery":
      return <SurgeryPage key={wanted.id} id={wanted.id} stage={wanted.stage} />;
    case "images":
      return <StageImagesPage key={`${wanted.id} ${wanted.stage}`} surgeryId={wanted.id} stage={wanted.stage} />;
    case "calibrations":
      return <CalibrationsPage />;
    case "calibration":
      return <CalibrationPage key={wanted.id} id={wanted.id} />;
    case "radiographs":
      return <RadiographsPage key={wanted.id} surgeryId={wanted.id} />;
    case "setup":
      return <SetupPage key={wanted.id} surgeryId={wanted.id} />;
    case "planner":
      return <PlannerPage />;
    case "unknown":
      return <UnknownPage />;
  }
}

function UnknownPage(): VNode {
  return (
    <div class="stack">
      <h1>No such page</h1>
      <p>
        The address names no page. <a href={href(paths.surgeries)}>All surgeries</a>
      </p>
    </div>
  );
}
