/** Places of labels: in a column beside the spine, apart from each other, each with a line to its vertebra. */

export interface Anchor {
  readonly key: string;
  readonly x: number;
  readonly y: number;
}

export interface LabelPlace {
  readonly key: string;
  /** Where the line begins, at the vertebra, px. */
  readonly from: readonly [number, number];
  /** Where the label begins, at its middle height, px. */
  readonly at: readonly [number, number];
}

export interface ColumnOptions {
  /** Least distance of two labels, px. */
  readonly spacing: number;
  /** The part of the screen that labels may use, px. */
  readonly top: number;
  readonly bottom: number;
  /** Where the column is, px. */
  readonly x: number;
}

/**
 * Labels in one column, in the order of their vertebrae on the screen: as near as the spacing lets them be to the heights
 * of their vertebrae (least squares, by pooling neighbours that would overlap), inside the screen. Closer together than
 * the spacing only when the screen is too low for all.
 */
export function labelColumn(anchors: readonly Anchor[], options: ColumnOptions): LabelPlace[] {
  const { top, bottom, x } = options;
  const sorted = [...anchors].sort((a, b) => a.y - b.y || a.x - b.x);
  const room = Math.max(0, bottom - top);
  const spacing = Math.min(options.spacing, room / Math.max(1, sorted.length - 1));
  const pools: { sum: number; count: number }[] = [];
  sorted.forEach((anchor, k) => {
    pools.push({ sum: anchor.y - k * spacing, count: 1 });
    while (pools.length > 1) {
      const [above, below] = [pools.at(-2), pools.at(-1)];
      if (!above || !below || above.sum / above.count <= below.sum / below.count) break;
      pools.splice(-2, 2, { sum: above.sum + below.sum, count: above.count + below.count });
    }
  });
  const lowest = bottom - spacing * Math.max(0, sorted.length - 1);
  const shifts = pools.flatMap(({ sum, count }) =>
    Array.from({ length: count }, () => Math.max(top, Math.min(lowest, sum / count))),
  );
  return sorted.map((anchor, k) => ({
    key: anchor.key,
    from: [anchor.x, anchor.y] as const,
    at: [x, (shifts[k] ?? top) + k * spacing] as const,
  }));
}
