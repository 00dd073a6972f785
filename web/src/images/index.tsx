/** The images of a stage, and corrections by hand. */
export { ImagesPage, ImagesPage as StageImagesPage } from "./images-page";
