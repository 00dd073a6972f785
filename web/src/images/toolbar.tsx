/** Zoom, contrast and layers of both images. */
import type { VNode } from "preact";

import { type Layers, LAYER_NAMES } from "./looks";
import { type Contrast, PLAIN } from "./levels";

interface ToolbarProps {
  zoom: number;
  onZoom: (factor: number) => void;
  onFit: () => void;
  /** Show all balls as large as possible. */
  onFrame: () => void;
  contrast: Contrast;
  /** Contrast as it is at first. */
  plain: Contrast;
  onContrast: (contrast: Contrast) => void;
  layers: Layers;
  onLayers: (layers: Layers) => void;
  ellipseFactor: number;
}

/** The controls over the images. */
export function Toolbar(props: ToolbarProps): VNode {
  const { zoom, contrast, layers, onContrast, onLayers } = props;
  const layerKeys = Object.keys(LAYER_NAMES) as (keyof Layers)[];
  return (
    <div class="images-toolbar no-print">
      <div class="row" role="group" aria-label="Zoom of both images">
        <span class="button-group">
          <button type="button" class="button button-small" onClick={() => props.onZoom(1 / 1.5)} aria-label="Zoom out">
            −
          </button>
          <button type="button" class="button button-small" onClick={() => props.onZoom(1.5)} aria-label="Zoom in">
            +
          </button>
          <button type="button" class="button button-small" onClick={props.onFit}>
            Fit
          </button>
          <button type="button" class="button button-small" onClick={props.onFrame}>
            Balls
          </button>
        </span>
        <output class="small muted images-zoom">{Math.round(zoom * 100)}%</output>
      </div>
      <div class="row" role="group" aria-label="Gray levels of both images">
        <Slider
          name="Brightness"
          value={Math.round(contrast.brightness * 100)}
          min={-100}
          max={100}
          text={`${Math.round(contrast.brightness * 100)}%`}
          onInput={(value) => onContrast({ ...contrast, brightness: value / 100 })}
        />
        <Slider
          name="Contrast"
          value={Math.round(Math.log2(contrast.contrast) * 50)}
          min={-100}
          max={200}
          text={`${Math.round(contrast.contrast * 100)}%`}
          onInput={(value) => onContrast({ ...contrast, contrast: 2 ** (value / 50) })}
        />
        <button
          type="button"
          class="button button-small"
          aria-pressed={contrast.stretched}
          title="Show the levels that occur in each image from black to white"
          onClick={() => onContrast({ ...PLAIN, stretched: !contrast.stretched })}
        >
          Stretch
        </button>
        <button type="button" class="button button-small" onClick={() => onContrast(props.plain)}>
          Reset
        </button>
      </div>
      <fieldset class="row images-layers">
        <legend class="visually-hidden">What is drawn over the images</legend>
        {layerKeys.map((key) => (
          <label class="check">
            <input
              type="checkbox"
              checked={layers[key]}
              onChange={(event) => onLayers({ ...layers, [key]: event.currentTarget.checked })}
            />
            {LAYER_NAMES[key]}
            {key === "ellipses" && <span class="muted"> (enlarged ×{props.ellipseFactor})</span>}
          </label>
        ))}
      </fieldset>
    </div>
  );
}

interface SliderProps {
  name: string;
  value: number;
  min: number;
  max: number;
  text: string;
  onInput: (value: number) => void;
}

function Slider({ name, value, min, max, text, onInput }: SliderProps): VNode {
  return (
    <label class="slider small">
      <span class="muted">{name}</span>
      <input
        type="range"
        min={min}
        max={max}
        step={1}
        value={value}
        aria-valuetext={text}
        onInput={(event) => onInput(Number(event.currentTarget.value))}
      />
      <span class="slider-value">{text}</span>
    </label>
  );
}
