/** The tables below the images. */
import type { VNode } from "preact";

import type { Explanation, Stage } from "../api/types";
import { BallsTable } from "./balls-table";
import type { Side } from "./camera";
import { FeaturesPanel } from "./features-panel";
import { Tabs } from "./tabs";
import { TakesPanel } from "./takes-panel";
import { TripletsPanel } from "./triplets-panel";
import type { SceneState } from "./use-scene";

interface FoundTabsProps {
  state: SceneState;
  explanation: Explanation | null;
  takes: readonly Stage[];
  counted: Stage | null;
  shown: Stage;
  compared: number | null;
  editing: boolean;
  /** Key of the tab that is open. */
  tab: string;
  selected: { side: Side; key: string } | null;
  candidate: number | null;
  onTab: (key: string) => void;
  onSelect: (side: Side, key: string) => void;
  onHover: (place: { side: Side; key: string } | null) => void;
  onCandidate: (index: number | null) => void;
  onLook: (index: number) => void;
  onShow: (take: number) => void;
  onCompare: (take: number | null) => void;
}

/** Balls, candidate triads, features and takes. */
export function FoundTabs(props: FoundTabsProps): VNode {
  const { base, scene, comparison } = props.state;
  const { explanation, onSelect, onHover } = props;
  const contents = {
    balls: () => <BallsTable scene={scene} selected={props.selected} onSelect={onSelect} onHover={onHover} />,
    triplets: () => (
      <TripletsPanel
        explanation={explanation}
        scene={base}
        shown={props.candidate}
        onShow={props.onCandidate}
        onLook={props.onLook}
      />
    ),
    features: () => <FeaturesPanel scene={base} onSelect={onSelect} onHover={onHover} />,
    takes: () => (
      <TakesPanel
        takes={props.takes}
        counted={props.counted}
        shown={props.shown}
        compared={props.compared}
        comparison={comparison}
        canShow={!props.editing}
        onShow={props.onShow}
        onCompare={props.onCompare}
      />
    ),
  };
  const tabs = [
    { key: "balls", name: "Balls", content: contents.balls },
    { key: "triplets", name: "Candidate triads", content: contents.triplets },
    { key: "features", name: "Features", content: contents.features },
    { key: "takes", name: `Takes (${props.takes.length})`, content: contents.takes },
  ];
  return <Tabs label="What was found in the images" tabs={tabs} shown={props.tab} onShow={props.onTab} />;
}
