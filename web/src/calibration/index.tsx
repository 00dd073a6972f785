/** Pages of calibrations. */
export { CalibrationPage } from "./calibration-page";
export { CalibrationsPage } from "./calibrations-page";
