/** The results of a stage: the spine, its measures and its vertebrae. They are loaded when they are first shown. */
import { lazy } from "../app/lazy";

export const SpinePanel = lazy(() => import("../spine3d").then((area) => area.SpinePanel));
export const MeasuresPanel = lazy(() => import("../measures").then((area) => area.MeasuresPanel));
export const AttributionPanel = lazy(() => import("../measures").then((area) => area.AttributionPanel));
export const VertebraTable = lazy(() => import("../measures").then((area) => area.VertebraTable));
