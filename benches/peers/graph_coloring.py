"""Colours of the graph of `--bench grouping` by graph-tool, igraph and networkx, those of them that are at hand.

    apt install python3-graph-tool; pip install igraph networkx numpy
    ORGANZA_EDGES=edges.bin cargo bench -p organza-benches --bench grouping
    python3 benches/peers/graph_coloring.py edges.bin

Least processor time of several runs of each; graph-tool and networkx colour by falling degree, igraph by coloured neighbours.
"""

import sys
import time

import numpy

REPEATS = 5


def measure(name, color, repeats=REPEATS):
    best, colors = float("inf"), None
    for _ in range(repeats):
        start = time.process_time()
        colors = color()
        best = min(best, time.process_time() - start)
    print(f"{name:>12}: {best * 1e3:8.0f} ms, {len(set(colors))} colours", flush=True)


def graph_tool(edges):
    from graph_tool import Graph, topology

    graph = Graph(directed=False)
    graph.add_edge_list(edges)
    degrees = graph.degree_property_map("out").a
    order = graph.new_vertex_property("int", numpy.argsort(-degrees, kind="stable"))
    measure("graph-tool", lambda: topology.sequential_vertex_coloring(graph, order).a)


def igraph(edges):
    from igraph import Graph

    graph = Graph(edges=edges)
    measure("igraph", graph.vertex_coloring_greedy)


def networkx(edges):
    import networkx

    graph = networkx.Graph()
    graph.add_edges_from(edges.tolist())
    measure("networkx", lambda: networkx.greedy_color(graph, "largest_first").values(), 1)


def main():
    edges = numpy.fromfile(sys.argv[1], dtype="<u4").reshape(-1, 2).astype(numpy.int64)
    print(f"{edges.max() + 1} nodes, {len(edges)} edges")
    for peer in (graph_tool, igraph, networkx):
        try:
            peer(edges)
        except ImportError as missing:
            print(f"{peer.__name__:>12}: {missing}")


main()
